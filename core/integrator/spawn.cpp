#include "core/integrator/spawn.h"

#include <cmath>

namespace tessera {

SurfacePoint world_surface(const Scene& scene, std::uint32_t object, std::uint32_t primitive, const Ray& ray, float t) {
  const Object& o = scene.objects[object];
  const Shape& shape = scene.shapes[o.shape];
  if (!o.placement) return surface(shape, primitive, ray, t);

  const Transform& placement = *o.placement;
  const SurfacePoint local = surface(shape, primitive, placement.to_local(ray), t);
  SurfacePoint world;
  const Vec3d p = placement.point_to_world(to_double(local.position));
  world.position = to_float(p);
  // The local error, carried over; the rounding of p itself; and that of the next ray's way back into local space.
  const auto& rows = placement.rows();
  const Transform::Error e = placement.error();
  const double back = 8 * kUnitRoundoff * (e.condition * max_component(abs(p)) + e.offset);
  for (int i = 0; i < 3; ++i) {
    double carried = 0;
    for (int j = 0; j < 3; ++j) carried += std::abs(rows[static_cast<std::size_t>(i * 4 + j)]) * local.error[j];
    world.error[i] = static_cast<float>(carried + 2 * kUnitRoundoff * std::abs(p[i]) + back);
  }
  const auto to_world = [&](Vec3 n) {
    const auto unit = UnitVec3::normalize(placement.normal_to_world(to_double(n)));
    return unit ? unit->vec() : n;
  };
  world.geometric_normal = to_world(local.geometric_normal);
  world.shading_normal = to_world(local.shading_normal);
  return world;
}

Vec3 spawn_origin(const SurfacePoint& from, Vec3 toward) {
  const Vec3 n = from.geometric_normal;
  const float side = dot(n, toward) < 0 ? -1.0F : 1.0F;
  // Twice the bound: once for the position, once for the rounding of the moved point.
  const float distance = 2 * dot(abs(n), from.error);
  Vec3 origin = from.position + n * (side * distance);
  for (int i = 0; i < 3; ++i) {
    const float away = side * n[i];
    if (away > 0) origin[i] = std::nextafter(origin[i], kInfinity);
    if (away < 0) origin[i] = std::nextafter(origin[i], -kInfinity);
  }
  return origin;
}

}  // namespace tessera

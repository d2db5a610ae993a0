#include "core/integrator/spawn.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace tessera {
namespace {

Vec3d normal_to_world(const Transform& placement, Vec3d local) {
  const Vec3d n = placement.normal_to_world(local);
  const Vec3d scaled = n / max_component(abs(n));
  return scaled / length(scaled);
}

/// A float that is greater than the finite `x`: `origin`, which is x rounded, or the next one above it. Without
/// branches, since which way a number was rounded can't be predicted.
float raised_above(double x, float origin) {
  const auto bits = std::bit_cast<std::int32_t>(origin);
  const std::int32_t from = bits == std::numeric_limits<std::int32_t>::min() ? 0 : bits;  // −0 is 0
  const std::int32_t next = from + (from >> 31 | 1);                                      // down to 0 from below
  const std::int32_t falls_short = -std::int32_t{origin <= x};
  return std::bit_cast<float>((next & falls_short) | (bits & ~falls_short));
}

}  // namespace

SurfacePoint world_surface(const Scene& scene, std::uint32_t object, std::uint32_t primitive, const Ray& ray, float t) {
  const Object& o = scene.objects[object];
  const Shape& shape = scene.shapes[o.shape];
  if (!o.placement) return surface(shape, primitive, ray, t);

  const Transform& placement = *o.placement;
  const SurfacePoint local = surface(shape, primitive, placement.to_local(ray), t);
  SurfacePoint world = local;
  const Transform::ToWorld to_world = placement.to_world();
  world.position = to_world.point(local.position);
  // The local error, carried over, and the float rounding of the next ray's way back into local space.
  const auto& rows = to_world.rows();
  const Vec3d back = placement.origin_error(world.position, to_world);
  for (int i = 0; i < 3; ++i) {
    const Vec3d row{rows[i * 4], rows[i * 4 + 1], rows[i * 4 + 2]};
    world.error[i] = dot(abs(row), local.error) + back[i];
    world.to_smooth[i] = dot(row, local.to_smooth);
  }
  world.geometric_normal = normal_to_world(placement, local.geometric_normal);
  world.shading_normal = normal_to_world(placement, local.shading_normal);
  return world;
}

Vec3 spawn_origin(const SurfacePoint& from, Vec3d toward, Vec3d away) {
  const Vec3d n = dot(from.geometric_normal, toward) < 0 ? -from.geometric_normal : from.geometric_normal;
  const Vec3d moved = from.position + n * (2 * dot(abs(n), from.error)) + away;
  Vec3 origin = to_float(moved);
  for (int i = 0; i < 3; ++i) {
    const float sign = std::copysign(1.0F, static_cast<float>(n[i]));
    if (n[i] != 0) origin[i] = sign * raised_above(double{sign} * moved[i], sign * origin[i]);
  }
  return origin;
}

void find_behind(const Accel& accel, std::span<const Ray> rays, std::span<const Hit> passed, std::span<Hit> hits,
                 TraceLog log) {
  accel.closest(rays, hits, log);
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (passed[i].t < kInfinity) hits[i] = accel.coincident(rays[i], passed[i], log).value_or(hits[i]);
}

PrimitiveId left_by(Vec3 direction, Vec3 normal, PrimitiveId surface) {
  return dot(direction, normal) > 0 ? surface : kNoPrimitive;
}

}  // namespace tessera

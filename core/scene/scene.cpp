#include "core/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "core/math/float_environment.h"
#include "core/scene/studio.h"

namespace tessera {

EnvironmentLight environment_of(const Scene& scene) {
  for (const Light& light : scene.lights)
    if (const auto* environment = std::get_if<EnvironmentLight>(&light)) return *environment;
  EnvironmentLight background;
  background.radiance = scene.background;
  return background;
}

Scene with_bounds(Scene scene) {
  const StrictFloats strict;
  scene.shape_bounds.clear();
  scene.shape_bounds.reserve(scene.shapes.size());
  for (const Shape& shape : scene.shapes) scene.shape_bounds.push_back(bounds(shape));
  return scene;
}

std::span<const Aabb> local_bounds(const Scene& scene) {
  if (scene.shape_bounds.size() != scene.shapes.size())
    throw std::logic_error("a scene is used without the bounds of its shapes");
  return scene.shape_bounds;
}

Aabb world_bounds(const Scene& scene, const Object& object) {
  return world_bounds(object, local_bounds(scene)[object.shape]);
}

Aabb world_bounds(const Object& object, const Aabb& local) {
  if (!object.placement || local.empty()) return local;
  const Transform::ToWorld to_world = object.placement->to_world();
  Vec3d lo{kInfinity, kInfinity, kInfinity}, hi = -lo;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d p = to_world.point({corner & 1 ? local.hi.x : local.lo.x,  //
                                    corner & 2 ? local.hi.y : local.lo.y, corner & 4 ? local.hi.z : local.lo.z});
    lo = min(lo, p);
    hi = max(hi, p);
  }
  return outward(lo, hi);
}

Outline world_outline(const Object& object, const Outline& local) {
  if (!object.placement) return local;
  const Transform::ToWorld to_world = object.placement->to_world();
  const auto& m = to_world.rows();
  const auto linear = [&](Vec3d v) {
    return Vec3d{m[0] * v.x + m[1] * v.y + m[2] * v.z, m[4] * v.x + m[5] * v.y + m[6] * v.z,
                 m[8] * v.x + m[9] * v.y + m[10] * v.z};
  };
  Outline world;
  world.points.reserve(local.points.size());
  double local_size = 0, world_size = 0;
  for (const Vec3 p : local.points) {
    const Vec3d placed = to_world.point(to_double(p));
    local_size = std::max<double>(local_size, max_component(abs(p)));
    world_size = std::max(world_size, max_component(abs(placed)));
    if (is_finite(to_float(placed)))
      world.points.push_back(to_float(placed));
    else
      world.ellipsoids.push_back({placed, {}});  // beyond a float: an ellipsoid of no size is a point in double
  }
  for (const Ellipsoid& e : local.ellipsoids) {
    world.ellipsoids.push_back({to_world.point(e.center), {}});
    for (int i = 0; i < 3; ++i) world.ellipsoids.back().axes[i] = linear(e.axes[i]);
    for (const Vec3d v : {e.center, e.axes[0], e.axes[1], e.axes[2]})
      local_size = std::max(local_size, max_component(abs(v)));
  }

  // Points round to float once. Before that, three products and three sums round by 2^-53 of no more than their
  // absolute values; an ellipsoid's centre and three axes do so four times.
  for (int row = 0; row < 12; row += 4) {
    const double stretch = std::abs(m[row]) + std::abs(m[row + 1]) + std::abs(m[row + 2]);
    const double rounding = 0x1p-48 * (stretch * local_size + std::abs(m[row + 3]));
    world.slack = std::max(world.slack, stretch * local.slack + rounding);
  }
  if (!world.points.empty()) world.slack += kUnitRoundoff * world_size + kDenormalStep;
  return world;
}

std::vector<Aabb> world_bounds(const Scene& scene) {
  const std::span<const Aabb> local = local_bounds(scene);
  std::vector<Aabb> world;
  world.reserve(scene.objects.size());
  for (const Object& object : scene.objects) world.push_back(world_bounds(object, local[object.shape]));
  return world;
}

std::size_t memory_bytes(const Scene& scene) {
  std::size_t bytes = sizeof(Scene) + scene.shapes.size() * (sizeof(Shape) + sizeof(Aabb)) +
                      scene.objects.size() * sizeof(Object) + scene.materials.size() * sizeof(Material) +
                      scene.textures.size() * sizeof(Texture) + scene.lights.size() * sizeof(Light);
  for (const Light& light : scene.lights)
    if (const auto* environment = std::get_if<EnvironmentLight>(&light);
        environment && environment->map && environment->map != studio_environment())
      bytes += environment->map->texels.size() * sizeof(Rgb);
  for (const Shape& shape : scene.shapes)
    if (const auto* mesh = std::get_if<TriangleMesh>(&shape))
      bytes += (mesh->positions.size() + mesh->normals.size()) * sizeof(Vec3) +
               mesh->triangles.size() * sizeof(TriangleIndices) +
               (mesh->attributes ? memory_bytes(*mesh->attributes) : 0);
  std::set<const TextureImage*> images;
  for (const Texture& texture : scene.textures)
    if (images.insert(texture.image.get()).second) bytes += texture.image->bytes();
  return bytes;
}

}  // namespace tessera

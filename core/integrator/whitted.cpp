#include "core/integrator/whitted.h"

#include <utility>

#include "core/integrator/shading.h"
#include "core/integrator/spawn.h"
#include "core/material/shade.h"

namespace tessera {
namespace {

Ray leaving(Vec3 origin, Vec3 direction, Vec3 normal, PrimitiveId surface) {
  return {origin, direction, 0, kInfinity, left_by(direction, normal, surface)};
}

}  // namespace

Whitted::Whitted(const Scene& scene, const Accel& accel, std::uint32_t max_depth, RayCounts& counts, TraceLog log,
                 std::stop_token stop)
    : scene_(scene),
      accel_(accel),
      max_depth_(max_depth),
      counts_(counts),
      log_(log),
      stop_(std::move(stop)),
      direct_light_(scene, accel, counts, log, stop_) {}

void Whitted::radiance(std::span<const Ray> rays, std::span<const Hit> hits, std::span<Rgb> out, std::uint32_t depth) {
  if (levels_.size() < depth) levels_.emplace_back();
  Level& level = levels_[depth - 1];
  level.points.clear();
  level.reflected.clear();
  level.refracted.clear();
  for (std::uint32_t i = 0; i < rays.size(); ++i) {
    const bool is_hit = hits[i].t < kInfinity;
    out[i] = is_hit ? Rgb() : scene_.background;
    if (is_hit) shade_hit(rays[i], hits[i], i, depth, level);
  }
  direct_light_.add(level.points, out);
  follow(level.reflected, out, depth, counts_.reflection);
  follow(level.refracted, out, depth, counts_.refraction);
}

void Whitted::shade_hit(const Ray& ray, const Hit& hit, std::uint32_t sum, std::uint32_t depth, Level& level) const {
  const Material& material = scene_.materials[scene_.objects[hit.object].material];
  const bool spawns = depth < max_depth_ && !(material.reflect.is_black() && material.transmit.is_black());
  LitPoint& point = level.points.emplace_back();
  point.material = &material;
  point.sum = sum;
  if (!spawns && !direct_light_.casts_shadows()) return;  // then nobody asks where the hit is

  const Vec3 direction = UnitVec3::normalize(ray.direction).value_or(UnitVec3::z());
  const Shading at(world_surface(scene_, hit.object, hit.primitive, ray, hit.t), direction);
  point.origin = point.smooth_origin = spawn_origin(at.surface, to_double(at.flat_normal));
  if (dot(at.surface.to_smooth, to_double(at.flat_normal)) > 0)
    point.smooth_origin = spawn_origin(at.surface, to_double(at.flat_normal), at.surface.to_smooth);
  point.surface = {hit.object, hit.primitive};
  point.flat_normal = at.flat_normal;
  point.normal = at.normal;
  point.to_viewer = at.to_viewer;
  if (spawns) spawn(material, at, point, level);
}

void Whitted::spawn(const Material& material, const Shading& at, const LitPoint& point, Level& level) {
  const Vec3 direction = -at.to_viewer;
  const float eta = at.entering ? material.ior : 1 / material.ior;
  const float reflected = material.fresnel ? fresnel(direction, at.normal, eta) : 1;
  const float passed = material.fresnel ? 1 - reflected : 1;
  if (!material.reflect.is_black())
    level.reflected.add(leaving(point.origin, mirrored(at), at.flat_normal, point.surface),
                        material.reflect * reflected, point.sum);
  if (!material.transmit.is_black())
    if (const auto bent = refracted(at, eta)) {
      const Vec3 origin = spawn_origin(at.surface, to_double(-at.flat_normal));
      level.refracted.add(leaving(origin, *bent, -at.flat_normal, point.surface), material.transmit * passed,
                          point.sum);
    }
}

/// Adds what the spawned rays of a batch of depth `depth` bring back.
void Whitted::follow(Spawned& spawned, std::span<Rgb> sums, std::uint32_t depth, std::uint64_t& count) {
  const std::size_t size = spawned.rays.size();
  if (size == 0 || stop_.stop_requested()) return;
  count += size;
  spawned.hits.resize(size);
  spawned.radiance.resize(size);
  accel_.closest(spawned.rays, spawned.hits, log_);
  radiance(spawned.rays, spawned.hits, spawned.radiance, depth + 1);
  for (std::size_t i = 0; i < size; ++i)
    sums[spawned.sums[i]] = sums[spawned.sums[i]] + spawned.weights[i] * spawned.radiance[i];
}

void Whitted::Spawned::clear() {
  rays.clear();
  weights.clear();
  sums.clear();
}

void Whitted::Spawned::add(const Ray& ray, Rgb weight, std::uint32_t sum) {
  rays.push_back(ray);
  weights.push_back(weight);
  sums.push_back(sum);
}

}  // namespace tessera

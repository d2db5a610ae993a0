#include "core/integrator/whitted.h"

#include <algorithm>
#include <cmath>

#include "core/integrator/shading.h"
#include "core/integrator/spawn.h"
#include "core/material/shade.h"
#include "core/material/surface_at.h"

namespace tessera {
namespace {

constexpr std::size_t kMirrored = 0, kRefracted = 1;

Ray leaving(Vec3 origin, Vec3 direction, Vec3 normal, PrimitiveId surface) {
  return {origin, direction, 0, kInfinity, left_by(direction, normal, surface)};
}

/// The first one's part of the rays that two branches may lead to. What a branch loses falls with the rays that it
/// gets, and weighs what the branch weighs: the sum of both is smallest where they share by the roots of the weights.
/// An eighth is for the lesser one in any case, so that no ray is missing down to a depth of 5.
std::uint32_t share(std::uint32_t rays, Rgb first_weight, Rgb second_weight) {
  const float first = std::sqrt(largest(first_weight)), second = std::sqrt(largest(second_weight));
  const float part = std::clamp(first / (first + second), 0.125F, 0.875F);
  return static_cast<std::uint32_t>(static_cast<float>(rays) * part + 0.5F);
}

}  // namespace

Whitted::Whitted(const Scene& scene, const Features& features, const Accel& accel, std::uint32_t max_depth,
                 RayCounts& counts, TraceLog log)
    : scene_(scene),
      casts_shadows_(features.shadows),
      accel_(accel),
      max_depth_(max_depth),
      counts_(counts),
      log_(log),
      direct_light_(accel, counts, log) {}

void Whitted::begin(std::span<const SampleId>, RaySpan rays, std::span<const Hit> hits, Output out) {
  if (camera_chains_.size() < rays.size()) camera_chains_.resize(rays.size());
  depth_ = 0;
  enter(rays, hits, {camera_chains_.data(), rays.size()}, out.radiance);
}

bool Whitted::go_on() {
  while (depth_ > 0) {
    Level& level = levels_[depth_ - 1];
    if (level.next_light < scene_.lights.size()) {
      direct_light_.add(scene_.lights[level.next_light++], level.points, level.sums);
      return true;
    }
    if (level.next_spawned < level.spawned.size()) {
      Spawned& spawned = level.spawned[level.next_spawned++];
      if (spawned.rays.empty()) continue;
      (&spawned == &level.spawned[kMirrored] ? counts_.reflection : counts_.refraction) += spawned.rays.size();
      trace(spawned);
      return true;
    }
    leave();
  }
  return false;
}

void Whitted::radiance(std::span<const Ray> rays, std::span<const Hit> hits, std::span<Rgb> out) {
  begin({}, rays, hits, {out, {}});
  while (go_on()) {
  }
}

/// Begins a batch of the next depth.
void Whitted::enter(RaySpan rays, std::span<const Hit> hits, std::span<const Chain> chains, std::span<Rgb> out) {
  if (levels_.size() == depth_) levels_.emplace_back();
  Level& level = levels_[depth_++];
  level.sums = out;
  level.points.clear();
  level.varied.clear();
  level.next_light = level.next_spawned = 0;
  for (Spawned& spawned : level.spawned) spawned.clear();
  for (std::uint32_t i = 0; i < rays.size(); ++i) {
    const bool is_hit = hits[i].t < kInfinity;
    out[i] = is_hit ? Rgb() : scene_.background;
    if (is_hit) shade_hit(rays[i], hits[i], chains[i], i, level);
  }
}

/// Ends the deepest batch: what its rays bring is added to the sums of those that spawned them.
void Whitted::leave() {
  if (--depth_ == 0) return;
  Level& level = levels_[depth_ - 1];
  const Spawned& spawned = level.spawned[level.next_spawned - 1];
  for (std::size_t i = 0; i < spawned.rays.size(); ++i) {
    Rgb& sum = level.sums[spawned.sums[i]];
    sum = sum + spawned.weights[i] * spawned.radiance[i];
  }
}

/// A tracer is made for each tile, and a scene may have more materials than a tile has pixels: so none is copied that
/// is Whitted's already, and none converted that no ray meets.
const WhittedSurface& Whitted::surface_of(const Ray& ray, const Hit& hit, Level& level) {
  const Object& object = scene_.objects[hit.object];
  const std::uint32_t material = object.material;
  if (varies(scene_.materials[material])) {
    SurfacePoint point = world_surface(scene_, hit.object, hit.primitive, ray, hit.t);
    const Surface there = surface_at(scene_, object, hit.primitive, point).surface;
    return level.varied.emplace_back(whitted_surface(there).value_or(WhittedSurface{}));
  }
  const Surface& surface = scene_.materials[material].surface;
  if (const auto* own = std::get_if<WhittedSurface>(&surface)) return *own;
  const auto [found, is_new] = converted_.try_emplace(material);
  if (is_new) found->second = whitted_surface(surface).value_or(WhittedSurface{});
  return found->second;
}

void Whitted::shade_hit(const Ray& ray, const Hit& hit, const Chain& chain, std::uint32_t sum, Level& level) {
  const WhittedSurface& material = surface_of(ray, hit, level);
  const bool spawns =
      depth_ < max_depth_ && chain.most_below > 0 && !(material.reflect.is_black() && material.transmit.is_black());
  LitPoint& point = level.points.emplace_back();
  point.material = &material;
  point.sum = sum;
  if (!spawns && !casts_shadows_) return;  // then nobody asks where the hit is

  const Vec3 direction = UnitVec3::normalize(ray.direction).value_or(UnitVec3::z());
  const Shading at(world_surface(scene_, hit.object, hit.primitive, ray, hit.t), direction);
  point.origin = point.smooth_origin = spawn_origin(at.surface, to_double(at.flat_normal));
  if (dot(at.surface.to_smooth, to_double(at.flat_normal)) > 0)
    point.smooth_origin = spawn_origin(at.surface, to_double(at.flat_normal), at.surface.to_smooth);
  point.surface = {hit.object, hit.primitive};
  point.flat_normal = at.flat_normal;
  point.normal = at.normal;
  point.to_viewer = at.to_viewer;
  if (spawns) spawn(material, at, point, chain, level);
}

void Whitted::spawn(const WhittedSurface& material, const Shading& at, const LitPoint& point, const Chain& chain,
                    Level& level) {
  const Vec3 direction = -at.to_viewer;
  const float eta = at.entering ? material.ior : 1 / material.ior;
  const float reflected = material.fresnel ? fresnel(direction, at.normal, eta) : 1;
  const float passed = material.fresnel ? 1 - reflected : 1;
  const Rgb mirror_weight = material.reflect * reflected, bent_weight = material.transmit * passed;
  const auto is_cut = [&](Rgb weight) { return largest(chain.throughput * weight) < kSmallestThroughput; };
  const bool mirrors = !is_cut(mirror_weight);
  const auto bent = is_cut(bent_weight) ? std::nullopt : refracted(at, eta);

  std::uint32_t mirrored_rays = mirrors ? chain.most_below : 0;
  if (mirrors && bent) mirrored_rays = share(chain.most_below, mirror_weight, bent_weight);
  const std::uint32_t bent_rays = bent ? chain.most_below - mirrored_rays : 0;
  if (mirrored_rays > 0)
    level.spawned[kMirrored].add(leaving(point.origin, mirrored(at), at.flat_normal, point.surface),
                                 {chain.throughput * mirror_weight, mirrored_rays - 1}, mirror_weight, point.sum);
  if (bent_rays > 0) {
    const Vec3 origin = spawn_origin(at.surface, to_double(-at.flat_normal));
    level.spawned[kRefracted].add(leaving(origin, *bent, -at.flat_normal, point.surface),
                                  {chain.throughput * bent_weight, bent_rays - 1}, bent_weight, point.sum);
  }
}

void Whitted::trace(Spawned& spawned) {
  spawned.hits.resize(spawned.rays.size());
  spawned.radiance.resize(spawned.rays.size());
  accel_.closest(spawned.rays, spawned.hits, log_);
  enter(spawned.rays, spawned.hits, spawned.chains, spawned.radiance);
}

void Whitted::Spawned::clear() {
  rays.clear();
  chains.clear();
  weights.clear();
  sums.clear();
}

void Whitted::Spawned::add(const Ray& ray, const Chain& chain, Rgb weight, std::uint32_t sum) {
  rays.push_back(ray);
  chains.push_back(chain);
  weights.push_back(weight);
  sums.push_back(sum);
}

}  // namespace tessera

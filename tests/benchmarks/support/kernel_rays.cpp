#include "tests/benchmarks/support/kernel_rays.h"

#include <algorithm>
#include <cmath>

#include "core/integrator/spawn.h"
#include "core/light/illuminate.h"
#include "core/sampling/pixel_samples.h"
#include "core/screen/camera_rays.h"
#include "tests/benchmarks/support/ray_sample.h"
#include "tests/support/random.h"

namespace tessera::bench {
namespace {

void add_tile(const CameraRays& camera, std::uint32_t tile_x, std::uint32_t tile_y, RaySet& set) {
  for (std::uint32_t i = 0; i < kTileSide * kTileSide; ++i) {
    constexpr std::uint32_t kInBlock = kBlockSide * kBlockSide, kAcross = kTileSide / kBlockSide;
    const std::uint32_t block = i / kInBlock, pixel = i % kInBlock;
    const std::uint32_t x = tile_x + block % kAcross * kBlockSide + pixel % kBlockSide;
    const std::uint32_t y = tile_y + block / kAcross * kBlockSide + pixel / kBlockSide;
    const PixelOffset offset = PixelOffsets(0, 1, true).of(x, y, 0);
    set.rays.push_back(camera.ray(x + offset.x, y + offset.y));
    set.directions.push_back(set.rays.back().direction);
  }
  set.ends.push_back(set.rays.size());
}

RaySet first_level_rays(const Camera& camera, std::uint32_t side) {
  const CameraRays rays(camera, side, side);
  RaySet set{"first_level", Query::closest_fan, {}, {}, {}, {}};
  set.rays.reserve(std::size_t{side} * side);
  for (const std::uint32_t first_row : {0U, kTileSide})
    for (std::uint32_t y = first_row; y < side; y += 2 * kTileSide)
      for (std::uint32_t x = 0; x < side; x += kTileSide) add_tile(rays, x, y, set);
  return set;
}

void cut_into_batches(RaySet& set, std::size_t batch) {
  for (std::size_t end = batch; end < set.rays.size(); end += batch) set.ends.push_back(end);
  if (!set.rays.empty()) set.ends.push_back(set.rays.size());
}

/// What leaves the points that first-level rays hit.
class SecondaryRays {
 public:
  SecondaryRays(const KernelScene& scene)
      : scene_(scene), short_way_(0.07F * length(world_bounds(*scene.scene, scene.scene->objects.front()).diagonal())) {
    shadow_.apex = scene.light;
  }

  void leave(const Ray& ray, const Hit& hit) {
    SurfacePoint from = world_surface(*scene_.scene, hit.object, hit.primitive, ray, hit.t);
    if (dot(from.geometric_normal, to_double(ray.direction)) > 0) from.geometric_normal = -from.geometric_normal;
    const Vec3d to_light = to_double(scene_.light) - from.position;
    const auto leave = [&](RaySet& set, Ray out) {
      out.leaves = left_by(out.direction, to_float(from.geometric_normal), {hit.object, hit.primitive});
      set.rays.push_back(out);
    };
    if (dot(from.geometric_normal, to_light) > 0)
      leave(shadow_, shadow_ray(PointLight{scene_.light, {}}, spawn_origin(from, to_light)));
    leave(ao_, bounce(from, short_way_));
    leave(diffuse_, bounce(from, kInfinity));
  }

  /// A tile of first-level rays ends: one light's shadow rays are handed over with it.
  void end_tile() {
    const std::size_t before = shadow_.ends.empty() ? 0 : shadow_.ends.back();
    if (shadow_.rays.size() > before) shadow_.ends.push_back(shadow_.rays.size());
  }

  std::array<RaySet, 3> take() {
    cut_into_batches(ao_, kBatch);
    cut_into_batches(diffuse_, kBatch);
    return {std::move(shadow_), std::move(ao_), std::move(diffuse_)};
  }

 private:
  /// A point of the unit sphere on top of the normal is distributed like the cosine.
  Ray bounce(const SurfacePoint& from, float reach) {
    const Vec3d way = from.geometric_normal + random_.direction() * (1 - 1e-6);
    const Vec3d direction = way / length(way);
    return {spawn_origin(from, direction), to_float(direction), 0, reach};
  }

  const KernelScene& scene_;
  float short_way_;
  Random random_{1};
  RaySet shadow_{"shadow", Query::occluded_fan, {}, {}, {}, {}}, ao_{"ao", Query::occluded, {}, {}, {}, {}},
      diffuse_{"diffuse", Query::closest, {}, {}, {}, {}};
};

}  // namespace

RaySet::Range RaySet::half(int which) const {
  if (ends.empty()) return {0, 0};
  const std::size_t middle = ends.size() < 2 ? 0 : ends[ends.size() / 2 - 1];
  return which == 0 ? Range{0, middle} : Range{middle, rays.size()};
}

std::vector<RaySet> kernel_rays(const KernelScene& scene, const Accel& accel, std::uint32_t side) {
  std::vector<RaySet> sets = {first_level_rays(scene.camera, side)};
  SecondaryRays secondary(scene);
  std::vector<Hit> hits(kTileSide * kTileSide);
  const std::span<const Ray> first_level = sets.front().rays;
  for (std::size_t at = 0; at < first_level.size(); at += hits.size()) {
    const auto tile = first_level.subspan(at, hits.size());
    accel.closest_fan(RayFan(tile.front().origin, sets.front().directions).part(at, hits.size()), hits);
    for (std::size_t i = 0; i < tile.size(); ++i)
      if (hits[i].t < kInfinity) secondary.leave(tile[i], hits[i]);
    secondary.end_tile();
  }
  for (RaySet& set : secondary.take()) sets.push_back(std::move(set));
  sets.push_back({"random", Query::closest, {}, random_segments(*scene.scene, first_level.size() / 2, 1).rays, {}, {}});
  cut_into_batches(sets.back(), std::min(kRandomBatch, sets.back().rays.size() / 2));
  return sets;
}

RaySet part_of(const RaySet& set, std::size_t stride) {
  RaySet part{set.name, set.query, set.apex, {}, {}, {}};
  for (std::size_t i = 0; i < set.ends.size(); i += stride) {
    const std::size_t begin = i == 0 ? 0 : set.ends[i - 1];
    part.rays.insert(part.rays.end(), set.rays.begin() + static_cast<std::ptrdiff_t>(begin),
                     set.rays.begin() + static_cast<std::ptrdiff_t>(set.ends[i]));
    part.ends.push_back(part.rays.size());
  }
  if (part.query == Query::closest_fan) part.directions.append_those_of(part.rays);
  return part;
}

}  // namespace tessera::bench

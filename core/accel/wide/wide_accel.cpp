#include "core/accel/wide/wide_accel.h"

#include <algorithm>
#include <numeric>

#include "core/accel/make.h"
#include "core/accel/scene_items.h"
#include "core/accel/tally.h"
#include "core/accel/wide/ray_batch.h"
#include "core/accel/wide/wide_build.h"

namespace tessera {
namespace {

/// Runs `trace` with a tally that counts, or with one that costs nothing.
template <typename Trace>
auto counted(TraceLog log, Trace&& trace) {
  return log.counts ? trace(Tally(*log.counts)) : trace(NoTally());
}

bool all_traceable(std::span<const Ray> rays) { return std::ranges::all_of(rays, is_traceable); }

/// Objects that batches go through one by one; of more, each ray looks for its own in the hierarchy over them.
constexpr std::uint32_t kFewObjects = 32;

}  // namespace

WideAccel::WideAccel(std::shared_ptr<const Scene> scene, const AccelOptions& options, const WideKernels& kernels)
    : scene_(std::move(scene)),
      kernels_(kernels),
      boxes_(world_bounds(*scene_)),
      objects_(ObjectItems(*scene_, options), BoxBound(), options) {
  for (const Object& object : scene_->objects)
    if (object.placement) {
      const Transform::Error e = object.placement->error();
      placed_ = {std::max(placed_.condition, e.condition), std::max(placed_.offset, e.offset)};
    }
  if (boxes_.size() <= kFewObjects) {
    few_.resize(boxes_.size());
    std::iota(few_.begin(), few_.end(), 0);
  }
  for (const Shape& shape : scene_->shapes) {
    const auto* mesh = std::get_if<TriangleMesh>(&shape);
    meshes_.push_back(mesh ? build_wide(*mesh) : WideTree());
  }
}

void WideAccel::closest_in(std::uint32_t object, const Ray& world, Hit& best, TraceLog log) const {
  const Object& o = scene_->objects[object];
  const Ray ray = o.placement ? o.placement->to_local(world) : world;
  const Shape& shape = scene_->shapes[o.shape];
  if (log.tested) log.tested->mark(object);
  if (std::holds_alternative<TriangleMesh>(shape)) {
    if (!is_traceable(ray)) return;  // a transform may have flattened the direction to zero
    kernels_.closest(tree(o.shape), object, {&ray, 1}, {&best, 1}, log.counts);
  } else {
    const std::optional<float> t = intersect_single(shape, ray);
    if (log.counts) Tally(*log.counts).object(t.has_value());
    if (t) best = std::min(best, Hit{*t, object, 0});
  }
}

bool WideAccel::occluded_by(std::uint32_t object, const Ray& world, TraceLog log) const {
  const Object& o = scene_->objects[object];
  const Ray ray = o.placement ? o.placement->to_local(world) : world;
  const Shape& shape = scene_->shapes[o.shape];
  if (log.tested) log.tested->mark(object);
  if (std::holds_alternative<TriangleMesh>(shape)) {
    std::uint8_t hidden = 0;
    if (is_traceable(ray)) kernels_.occluded(tree(o.shape), {&ray, 1}, {&hidden, 1}, log.counts);
    return hidden;
  }
  const bool hit = intersect_single(shape, ray).has_value();
  if (log.counts) Tally(*log.counts).object(hit);
  return hit;
}

std::optional<Hit> WideAccel::closest(const Ray& ray, TraceLog log) const {
  if (!is_traceable(ray)) return std::nullopt;
  Hit best{ray.t_max};
  if (is_lone_mesh())
    closest_in(0, ray, best, log);
  else
    counted(log, [&](auto tally) {
      objects_.visit(ray, placed_, ray.t_max, tally, [&](std::uint32_t object, float) {
        closest_in(object, ray, best, log);
        return best.t;
      });
    });
  return best.t < ray.t_max ? std::optional(best) : std::nullopt;
}

bool WideAccel::occluded(const Ray& ray, TraceLog log) const {
  if (!is_traceable(ray)) return false;
  if (is_lone_mesh()) return occluded_by(0, ray, log);
  bool hidden = false;
  counted(log, [&](auto tally) {
    objects_.visit(ray, placed_, ray.t_max, tally, [&](std::uint32_t object, float limit) {
      hidden = occluded_by(object, ray, log);
      return hidden ? kStop : limit;
    });
  });
  return hidden;
}

std::optional<Hit> WideAccel::closest_among(const Ray& ray, std::span<const std::uint32_t> objects,
                                            TraceLog log) const {
  if (!is_traceable(ray)) return std::nullopt;
  Hit best{ray.t_max};
  const CullRay cull(ray, objects_.root(), placed_);
  for (const std::uint32_t object : objects)
    if (!cull.misses(boxes_[object], ray.t_min, best.t)) closest_in(object, ray, best, log);
  return best.t < ray.t_max ? std::optional(best) : std::nullopt;
}

void WideAccel::closest(std::span<const Ray> rays, std::span<Hit> hits, TraceLog log, Candidates among) const {
  if ((!among && few_.empty()) || !all_traceable(rays)) return Accel::closest(rays, hits, log, among);
  closest_by_object(rays, hits, among.value_or(few_), false, log);
}

void WideAccel::occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const {
  if (few_.empty() || !all_traceable(rays)) return Accel::occluded(rays, hidden, log);
  occluded_by_object(rays, hidden, std::nullopt, log);
}

void WideAccel::closest_fan(std::span<const Ray> rays, std::span<Hit> hits, TraceLog log, Candidates among) const {
  if ((!among && few_.empty()) || !all_traceable(rays)) return Accel::closest(rays, hits, log, among);
  for (std::size_t first = 0; first < rays.size(); first += kFanRays) {
    const std::size_t count = std::min(kFanRays, rays.size() - first);
    closest_by_object(rays.subspan(first, count), hits.subspan(first, count), among.value_or(few_), true, log);
  }
}

void WideAccel::occluded_fan(Vec3 apex, std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const {
  if (few_.empty() || !all_traceable(rays)) return Accel::occluded(rays, hidden, log);
  for (std::size_t first = 0; first < rays.size(); first += kFanRays) {
    const std::size_t count = std::min(kFanRays, rays.size() - first);
    occluded_by_object(rays.subspan(first, count), hidden.subspan(first, count), apex, log);
  }
}

void WideAccel::closest_by_object(std::span<const Ray> rays, std::span<Hit> hits,
                                  std::span<const std::uint32_t> objects, bool is_fan, TraceLog log) const {
  std::ranges::fill(hits, Hit{});
  if (rays.empty()) return;
  if (is_lone_mesh()) {
    if (log.tested) log.tested->mark(0);
    return closest_on(0, is_fan, rays, hits, log.counts);
  }
  RayBatch<Hit> batch(rays, hits, objects_.root(), placed_);
  std::vector<std::uint32_t> near_to_far(objects.begin(), objects.end());
  batch.sort(near_to_far, boxes_);
  counted(log, [&](auto tally) {
    for (const std::uint32_t object : near_to_far) {
      const Object& o = scene_->objects[object];
      if (!batch.pick(boxes_[object], o.placement, is_mesh(o), tally)) continue;
      if (log.tested) log.tested->mark(object);
      closest_on(object, is_fan, batch.rays(), batch.answers(), log.counts);
      batch.put_back();
    }
  });
}

void WideAccel::occluded_by_object(std::span<const Ray> rays, std::span<std::uint8_t> hidden, std::optional<Vec3> apex,
                                   TraceLog log) const {
  std::ranges::fill(hidden, 0);
  if (rays.empty()) return;
  if (is_lone_mesh()) {
    if (log.tested) log.tested->mark(0);
    return occluded_on(0, apex, rays, hidden, log.counts);
  }
  RayBatch<std::uint8_t> batch(rays, hidden, objects_.root(), placed_);
  counted(log, [&](auto tally) {
    for (const std::uint32_t object : few_) {
      const Object& o = scene_->objects[object];
      if (!batch.pick(boxes_[object], o.placement, is_mesh(o), tally)) continue;
      if (log.tested) log.tested->mark(object);
      // A placement rounds once more: of rays that lead to one point it leaves rays that nearly do.
      occluded_on(object, o.placement ? std::nullopt : apex, batch.rays(), batch.answers(), log.counts);
      batch.put_back();
    }
  });
}

void WideAccel::closest_on(std::uint32_t object, bool is_fan, std::span<const Ray> rays, std::span<Hit> hits,
                           TestCounts* counts) const {
  const Object& o = scene_->objects[object];
  if (is_mesh(o)) {
    const WideTree& mesh = tree(o.shape);
    if (is_fan && kernels_.closest_fan(mesh, object, rays, hits, counts)) return;
    return kernels_.closest(mesh, object, rays, hits, counts);
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const std::optional<float> t = intersect_single(scene_->shapes[o.shape], rays[i]);
    if (counts) Tally(*counts).object(t.has_value());
    if (t) hits[i] = std::min(hits[i], Hit{*t, object, 0});
  }
}

void WideAccel::occluded_on(std::uint32_t object, std::optional<Vec3> apex, std::span<const Ray> rays,
                            std::span<std::uint8_t> hidden, TestCounts* counts) const {
  const Object& o = scene_->objects[object];
  if (is_mesh(o)) {
    const WideTree& mesh = tree(o.shape);
    if (apex && kernels_.occluded_fan(mesh, *apex, rays, hidden, counts)) return;
    return kernels_.occluded(mesh, rays, hidden, counts);
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    hidden[i] = intersect_single(scene_->shapes[o.shape], rays[i]).has_value();
    if (counts) Tally(*counts).object(hidden[i]);
  }
}

bool WideAccel::is_mesh(const Object& object) const {
  return std::holds_alternative<TriangleMesh>(scene_->shapes[object.shape]);
}

bool WideAccel::is_lone_mesh() const {
  return scene_->objects.size() == 1 && !scene_->objects[0].placement && is_mesh(scene_->objects[0]);
}

AccelStats WideAccel::stats() const {
  AccelStats sum = objects_.stats();
  std::uint32_t deepest = 0;
  for (const WideTree& mesh : meshes_) {
    sum.bytes += mesh.stats.bytes;
    sum.nodes += mesh.stats.nodes;
    sum.leaves += mesh.stats.leaves;
    deepest = std::max(deepest, mesh.stats.depth);
  }
  sum.bytes += boxes_.size() * sizeof(Aabb);
  sum.depth += deepest;
  return sum;
}

std::unique_ptr<const Accel> make_wide(std::shared_ptr<const Scene> scene, const AccelOptions& options) {
  return std::make_unique<const WideAccel>(std::move(scene), options);
}

}  // namespace tessera

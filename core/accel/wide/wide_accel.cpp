#include "core/accel/wide/wide_accel.h"

#include <algorithm>
#include <array>

#include "core/accel/make.h"
#include "core/accel/scene_items.h"
#include "core/accel/tally.h"
#include "core/accel/wide/wide_build.h"

namespace tessera {
namespace {

/// Runs `trace` with a tally that counts, or with one that costs nothing.
template <typename Trace>
auto counted(TraceLog log, Trace&& trace) {
  return log.counts ? trace(Tally(*log.counts)) : trace(NoTally());
}

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
  Hit hit;
  closest(std::span(&ray, 1), std::span(&hit, 1), log);
  return hit.t < kInfinity ? std::optional(hit) : std::nullopt;
}

bool WideAccel::occluded(const Ray& ray, TraceLog log) const {
  std::uint8_t hidden = 0;
  occluded(std::span(&ray, 1), std::span(&hidden, 1), log);
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

void WideAccel::closest(std::span<const Ray> rays, std::span<Hit> hits, TraceLog log) const {
  if (const WideTree* mesh = lone_mesh()) {
    std::ranges::fill(hits, Hit{});
    kernels_.closest(*mesh, 0, rays, hits, log.counts);
    return;
  }
  counted(log, [&](auto tally) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      Hit best{rays[i].t_max};
      if (is_traceable(rays[i]))
        objects_.visit(rays[i], placed_, rays[i].t_max, tally, [&](std::uint32_t object, float) {
          closest_in(object, rays[i], best, log);
          return best.t;
        });
      hits[i] = best.t < rays[i].t_max ? best : Hit{};
    }
  });
}

void WideAccel::occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const {
  std::ranges::fill(hidden, 0);
  if (const WideTree* mesh = lone_mesh()) return kernels_.occluded(*mesh, rays, hidden, log.counts);
  counted(log, [&](auto tally) {
    for (std::size_t i = 0; i < rays.size(); ++i)
      if (is_traceable(rays[i]))
        objects_.visit(rays[i], placed_, rays[i].t_max, tally, [&](std::uint32_t object, float limit) {
          hidden[i] = occluded_by(object, rays[i], log);
          return hidden[i] ? kStop : limit;
        });
  });
}

void WideAccel::closest_fan(std::span<const Ray> rays, std::span<Hit> hits, TraceLog log) const {
  const WideTree* mesh = lone_mesh();
  if (!mesh) return closest(rays, hits, log);
  std::ranges::fill(hits, Hit{});
  for (std::size_t first = 0; first < rays.size(); first += kFanRays) {
    const std::size_t count = std::min(kFanRays, rays.size() - first);
    const auto some = rays.subspan(first, count);
    if (!kernels_.closest_fan(*mesh, 0, some, hits.subspan(first, count), log.counts))
      kernels_.closest(*mesh, 0, some, hits.subspan(first, count), log.counts);
  }
}

void WideAccel::occluded_fan(Vec3 apex, std::span<const Ray> rays, std::span<std::uint8_t> hidden, TraceLog log) const {
  const WideTree* mesh = lone_mesh();
  if (!mesh) return occluded(rays, hidden, log);
  std::ranges::fill(hidden, 0);
  for (std::size_t first = 0; first < rays.size(); first += kFanRays) {
    const std::size_t count = std::min(kFanRays, rays.size() - first);
    const auto some = rays.subspan(first, count);
    if (!kernels_.occluded_fan(*mesh, apex, some, hidden.subspan(first, count), log.counts))
      kernels_.occluded(*mesh, some, hidden.subspan(first, count), log.counts);
  }
}

const WideTree* WideAccel::lone_mesh() const {
  const bool is_alone = scene_->objects.size() == 1 && !scene_->objects[0].placement &&
                        std::holds_alternative<TriangleMesh>(scene_->shapes[scene_->objects[0].shape]);
  return is_alone ? &tree(scene_->objects[0].shape) : nullptr;
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

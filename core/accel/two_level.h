#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "core/accel/accel.h"
#include "core/accel/build_stop.h"
#include "core/accel/index.h"
#include "core/accel/scene_items.h"
#include "core/accel/tally.h"
#include "core/bounds/cull_ray.h"
#include "core/geometry/shape.h"
#include "core/geometry/shape_outline.h"
#include "core/geometry/triangle.h"

namespace tessera {

/// A structure made of one index over the objects of a scene and one over the triangles of each mesh, which its
/// instances share. All hits are decided here, by the geometry's own `intersect`; an index only leaves out what cannot
/// be hit (law L1). What an index looks like: README.md beside this file.
template <typename Index>
class TwoLevel final : public Accel {
 public:
  using B = typename Index::BoundType;
  using Accel::closest;
  using Accel::occluded;

  TwoLevel(std::shared_ptr<const Scene> scene, const AccelOptions& options, const B& bound = {})
      : TwoLevel(scene, options, bound, ObjectItems(*scene, options)) {}

  std::optional<Hit> closest(const Ray& ray, TraceLog log) const override {
    return counted(log, [&](auto tally) -> std::optional<Hit> {
      if (!is_traceable(ray)) return std::nullopt;
      Hit best{ray.t_max};
      objects_.visit(ray, placed_, ray.t_max, tally, [&](std::uint32_t object, float) {
        closest_in(object, ray, best, log.tested, tally);
        return best.t;
      });
      return found(best, ray);
    });
  }

  std::optional<Hit> closest_among(const Ray& ray, std::span<const std::uint32_t> objects,
                                   TraceLog log) const override {
    return counted(log, [&](auto tally) -> std::optional<Hit> {
      if (!is_traceable(ray)) return std::nullopt;
      Hit best{ray.t_max};
      const CullRay cull(ray, objects_.root(), placed_);
      for (const std::uint32_t object : objects) {
        if constexpr (Index::kCulls) {
          const bool misses = cull.misses(boxes_[object], ray.t_min, best.t);
          tally.volume(!misses);
          if (misses) continue;
        }
        const auto hits_before = tally.hits();
        closest_in(object, ray, best, log.tested, tally);
        if constexpr (Index::kCulls) tally.looked_into(hits_before);
      }
      return found(best, ray);
    });
  }

  bool occluded(const Ray& ray, TraceLog log) const override {
    return counted(log, [&](auto tally) {
      if (!is_traceable(ray)) return false;
      bool hit = false;
      objects_.visit(ray, placed_, ray.t_max, tally, [&](std::uint32_t object, float limit) {
        hit = occluded_by(object, ray, log.tested, tally);
        return hit ? kStop : limit;
      });
      return hit;
    });
  }

  std::optional<Hit> coincident(const Ray& ray, const Hit& hit, TraceLog log) const override {
    return counted(log, [&](auto tally) -> std::optional<Hit> {
      const Ray at = only_at(ray, hit.t);
      if (!is_traceable(at)) return std::nullopt;
      Hit best{at.t_max};
      objects_.visit(at, placed_, at.t_max, tally, [&](std::uint32_t object, float) {
        if (object > hit.object) closest_in(object, at, best, log.tested, tally);
        return best.t;
      });
      return found(best, at);
    });
  }

  AccelStats stats() const override {
    AccelStats sum = objects_.stats();
    std::uint32_t deepest = 0;
    for (const Index& mesh : meshes_) {
      const AccelStats s = mesh.stats();
      sum.bytes += s.bytes;
      sum.nodes += s.nodes;
      sum.leaves += s.leaves;
      deepest = std::max(deepest, s.depth);
    }
    sum.bytes += boxes_.size() * sizeof(Aabb) + own_.size() * sizeof(OwnVolume);
    for (const OwnVolume& own : own_) sum.bytes += bound_.bytes(own.volume);
    sum.depth += deepest;
    return sum;
  }

 private:
  TwoLevel(std::shared_ptr<const Scene> scene, const AccelOptions& options, const B& bound, const ObjectItems& items)
      : scene_(std::move(scene)), boxes_(items.boxes()), bound_(bound), objects_(items, bound, options) {
    for (const Object& object : scene_->objects)
      if (object.placement) {
        const Transform::Error e = object.placement->error();
        placed_ = {std::max(placed_.condition, e.condition), std::max(placed_.offset, e.offset)};
      }
    meshes_.reserve(scene_->shapes.size());
    const TriangleMesh none;
    for (const Shape& shape : scene_->shapes) {
      BuildStop::check();
      const auto* mesh = std::get_if<TriangleMesh>(&shape);
      meshes_.emplace_back(TriangleItems(mesh ? *mesh : none), bound, options);
    }
    if (!Index::kCulls || options.space == BoundSpace::world) return;
    own_.reserve(scene_->shapes.size());
    for (const Shape& shape : scene_->shapes) {
      Outline all = outline(shape);
      own_.push_back({bounds(shape), bound_.fit(all)});
    }
  }

  /// Around a shape, in its own space.
  struct OwnVolume {
    Aabb reach;
    typename B::Volume volume;
  };

  /// Runs `trace` with a tally that counts, or with one that costs nothing.
  template <typename Trace>
  static auto counted(TraceLog log, Trace&& trace) {
    return log.counts ? trace(Tally(*log.counts)) : trace(NoTally());
  }

  /// A best hit that is still the ray's end is none; with t_max infinite, no finite t equals it.
  static std::optional<Hit> found(const Hit& best, const Ray& ray) {
    if (best.t < ray.t_max) return best;
    return std::nullopt;
  }

  /// Whether the volume in the shape's own space is tested: where the index has none of its own for that.
  bool tests_own_volume(const Object& object, bool is_mesh) const {
    return !own_.empty() && (!Index::kHasRootVolume || (object.placement && !is_mesh));
  }

  /// Whether the ray (in the shape's space) can't hit the object before `limit`, by its volume in that space.
  template <typename Counter>
  bool misses_own_volume(const Object& object, bool is_mesh, const Ray& ray, float limit, Counter tally) const {
    if (!tests_own_volume(object, is_mesh) || !is_traceable(ray)) return false;
    const OwnVolume& own = own_[object.shape];
    const bool misses = CullRay::misses(bound_.clipper(ray, own.reach, {}).clip(own.volume), ray.t_min, limit);
    tally.volume(!misses);
    return misses;
  }

  template <typename Counter>
  void closest_in(std::uint32_t object, const Ray& world, Hit& best, ObjectMarks* tested, Counter tally) const {
    const Object& o = scene_->objects[object];
    const Ray ray = o.placement ? o.placement->to_local(world) : world;
    const Shape& shape = scene_->shapes[o.shape];
    const auto* mesh = std::get_if<TriangleMesh>(&shape);
    if (misses_own_volume(o, mesh, ray, best.t, tally)) return;
    if (tested) tested->mark(object);
    const auto hits_before = tally.hits();
    const auto offer = [&](std::optional<float> t, std::uint32_t primitive) {
      tally.object(t.has_value());
      if (t) best = std::min(best, Hit{*t, object, primitive});
    };
    if (mesh) {
      visit_triangles(o.shape, *mesh, ray, best.t, tally, [&](std::optional<float> t, std::uint32_t triangle) {
        offer(t, triangle);
        return best.t;
      });
    } else {
      offer(intersect_single(shape, ray), 0);
    }
    if (tests_own_volume(o, mesh)) tally.looked_into(hits_before);
  }

  template <typename Counter>
  bool occluded_by(std::uint32_t object, const Ray& world, ObjectMarks* tested, Counter tally) const {
    const Object& o = scene_->objects[object];
    const Ray ray = o.placement ? o.placement->to_local(world) : world;
    const Shape& shape = scene_->shapes[o.shape];
    const auto* mesh = std::get_if<TriangleMesh>(&shape);
    if (misses_own_volume(o, mesh, ray, ray.t_max, tally)) return false;
    if (tested) tested->mark(object);
    bool hit = false;
    if (mesh) {
      visit_triangles(o.shape, *mesh, ray, ray.t_max, tally, [&](std::optional<float> t, std::uint32_t) {
        hit = t.has_value();
        tally.object(hit);
        return hit ? kStop : ray.t_max;
      });
    } else {
      hit = intersect_single(shape, ray).has_value();
      tally.object(hit);
    }
    if (!hit && tests_own_volume(o, mesh)) tally.looked_into(tally.hits());
    return hit;
  }

  /// Calls `tested(t, triangle)` for every triangle that the mesh's index doesn't rule out; it returns the new limit.
  template <typename Counter, typename Tested>
  void visit_triangles(std::uint32_t shape, const TriangleMesh& mesh, const Ray& ray, float limit, Counter tally,
                       Tested&& tested) const {
    if (!is_traceable(ray)) return;  // a transform may have flattened the direction to zero
    const TriangleRay sheared(ray);
    meshes_[shape].visit(ray, {}, limit, tally, [&](std::uint32_t triangle, float) {
      const TriangleIndices& t = mesh.triangles[triangle];
      return tested(intersect_triangle(sheared, mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]),
                    triangle);
    });
  }

  std::shared_ptr<const Scene> scene_;
  std::vector<Aabb> boxes_;
  B bound_;
  Index objects_;
  std::vector<Index> meshes_;   ///< By shape; empty indices for what isn't a mesh.
  std::vector<OwnVolume> own_;  ///< By shape; none where volumes stand in the world.
  Transform::Error placed_;
};

}  // namespace tessera

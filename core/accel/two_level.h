#pragma once

#include <algorithm>
#include <vector>

#include "core/accel/accel.h"
#include "core/accel/box_tree.h"
#include "core/bounds/cull_ray.h"
#include "core/geometry/shape.h"
#include "core/geometry/triangle.h"

namespace tessera {

/// A structure made of one index over the objects of a scene and one over the triangles of each mesh, which its
/// instances share. `Index` is `BoxTree` or anything with its face. All hits are decided here, by the geometry's
/// own `intersect`; the index only leaves out what cannot be hit (law L1).
template <typename Index>
class TwoLevel final : public Accel {
 public:
  explicit TwoLevel(std::shared_ptr<const Scene> scene)
      : scene_(std::move(scene)), boxes_(object_boxes(*scene_)), objects_(boxes_) {
    for (const Object& object : scene_->objects)
      if (object.placement) {
        const Transform::Error e = object.placement->error();
        placed_ = {std::max(placed_.condition, e.condition), std::max(placed_.offset, e.offset)};
      }
    meshes_.reserve(scene_->shapes.size());
    for (const Shape& shape : scene_->shapes) meshes_.emplace_back(triangle_boxes(shape));
  }

  std::optional<Hit> closest(const Ray& ray, TraceLog log) const override {
    if (!is_traceable(ray)) return std::nullopt;
    Hit best{ray.t_max};
    objects_.visit(CullRay(ray, objects_.root(), placed_), ray.t_min, ray.t_max, [&](std::uint32_t object, float) {
      if (log.tested) log.tested->mark(object);
      closest_in(object, ray, best);
      return best.t;
    });
    return found(best, ray);
  }

  std::optional<Hit> closest_among(const Ray& ray, std::span<const std::uint32_t> objects,
                                   TraceLog log) const override {
    if (!is_traceable(ray)) return std::nullopt;
    Hit best{ray.t_max};
    const CullRay cull(ray, objects_.root(), placed_);
    for (const std::uint32_t object : objects) {
      if (Index::kCulls && cull.misses(boxes_[object], ray.t_min, best.t)) continue;
      if (log.tested) log.tested->mark(object);
      closest_in(object, ray, best);
    }
    return found(best, ray);
  }

  bool occluded(const Ray& ray, TraceLog log) const override {
    if (!is_traceable(ray)) return false;
    bool hit = false;
    objects_.visit(CullRay(ray, objects_.root(), placed_), ray.t_min, ray.t_max,
                   [&](std::uint32_t object, float limit) {
                     if (log.tested) log.tested->mark(object);
                     hit = occluded_by(object, ray);
                     return hit ? kStop : limit;
                   });
    return hit;
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
    sum.bytes += boxes_.size() * sizeof(Aabb);
    sum.depth += deepest;
    return sum;
  }

 private:
  static std::vector<Aabb> object_boxes(const Scene& scene) {
    std::vector<Aabb> boxes;
    boxes.reserve(scene.objects.size());
    for (const Object& object : scene.objects) boxes.push_back(world_bounds(scene, object));
    return boxes;
  }

  static std::vector<Aabb> triangle_boxes(const Shape& shape) {
    std::vector<Aabb> boxes;
    if (const auto* mesh = std::get_if<TriangleMesh>(&shape)) {
      boxes.resize(mesh->triangles.size());
      for (std::size_t i = 0; i < boxes.size(); ++i)
        for (const std::uint32_t corner : mesh->triangles[i]) boxes[i].extend(mesh->positions[corner]);
    }
    return boxes;
  }

  /// A best hit that is still the ray's end is none; with t_max infinite, no finite t equals it.
  static std::optional<Hit> found(const Hit& best, const Ray& ray) {
    if (best.t < ray.t_max) return best;
    return std::nullopt;
  }

  void closest_in(std::uint32_t object, const Ray& world, Hit& best) const {
    const Object& o = scene_->objects[object];
    const Ray ray = o.placement ? o.placement->to_local(world) : world;
    const auto offer = [&](std::optional<float> t, std::uint32_t primitive) {
      if (t) best = std::min(best, Hit{*t, object, primitive});
    };
    const Shape& shape = scene_->shapes[o.shape];
    if (const auto* mesh = std::get_if<TriangleMesh>(&shape)) {
      visit_triangles(o.shape, *mesh, ray, best.t, [&](std::optional<float> t, std::uint32_t triangle) {
        offer(t, triangle);
        return best.t;
      });
    } else {
      offer(intersect_single(shape, ray), 0);
    }
  }

  bool occluded_by(std::uint32_t object, const Ray& world) const {
    const Object& o = scene_->objects[object];
    const Ray ray = o.placement ? o.placement->to_local(world) : world;
    const Shape& shape = scene_->shapes[o.shape];
    const auto* mesh = std::get_if<TriangleMesh>(&shape);
    if (!mesh) return intersect_single(shape, ray).has_value();
    bool hit = false;
    visit_triangles(o.shape, *mesh, ray, ray.t_max, [&](std::optional<float> t, std::uint32_t) {
      hit = t.has_value();
      return hit ? kStop : ray.t_max;
    });
    return hit;
  }

  /// Calls `tested(t, triangle)` for every triangle that the mesh's index doesn't rule out; it returns the new limit.
  template <typename Tested>
  void visit_triangles(std::uint32_t shape, const TriangleMesh& mesh, const Ray& ray, float limit,
                       Tested&& tested) const {
    if (!is_traceable(ray)) return;  // a transform may have flattened the direction to zero
    const Index& index = meshes_[shape];
    const TriangleRay sheared(ray);
    index.visit(CullRay(ray, index.root()), ray.t_min, limit, [&](std::uint32_t triangle, float) {
      const TriangleIndices& t = mesh.triangles[triangle];
      return tested(intersect_triangle(sheared, mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]),
                    triangle);
    });
  }

  std::shared_ptr<const Scene> scene_;
  std::vector<Aabb> boxes_;
  Index objects_;
  std::vector<Index> meshes_;  ///< By shape; empty indices for what isn't a mesh.
  Transform::Error placed_;
};

}  // namespace tessera

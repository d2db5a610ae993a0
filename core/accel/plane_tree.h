#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "core/accel/accel.h"
#include "core/accel/index.h"
#include "core/accel/items.h"
#include "core/accel/mailbox.h"
#include "core/accel/plane.h"
#include "core/bounds/box_bound.h"

namespace tessera {

/// Space, cut in two by planes again and again until a cell holds few items: octree and kd-tree with `AxisPlane`, BSP
/// with `FreePlane`. What they differ in is who chooses the planes (`Build`); they share the walk (Havran 2000,
/// TA^B_rec).
template <typename Plane>
struct PlaneNodes {
  /// An inner node's children are `first`, below its plane, and `first + 1`; a leaf has `count` items from `first` on.
  struct Node {
    Plane plane;
    std::uint32_t first = 0;
    std::uint32_t count = kInner;
  };
  static constexpr std::uint32_t kInner = std::numeric_limits<std::uint32_t>::max();
  static constexpr int kMostDepth = 64;

  Aabb root;
  std::vector<Node> nodes;
  std::vector<std::uint32_t> items;
  std::uint32_t depth = 0;  ///< < `kMostDepth`.
  std::uint64_t leaves = 0;
};

template <typename Plane, PlaneNodes<Plane> (*build)(const Items&, const AccelOptions&)>
class PlaneTree {
 public:
  using BoundType = BoxBound;
  static constexpr bool kCulls = true;
  static constexpr bool kHasRootVolume = true;

  PlaneTree(const Items& items, const BoxBound&, const AccelOptions& options) : tree_(build(items, options)) {}

  Aabb root() const { return tree_.root; }

  /// As `BoundTree::visit`; an item in several cells may be visited more than once.
  template <typename Counter, typename Leaf>
  void visit(const Ray& ray, Transform::Error placed, float limit, Counter tally, Leaf&& leaf) const {
    if (tree_.nodes.empty()) return;
    const typename Plane::Crosser crosser(ray, tree_.root, placed);
    const Interval span = crosser.clip(tree_.root);
    const bool misses = CullRay::misses(span, ray.t_min, limit);
    tally.volume(!misses);
    if (misses) return;

    struct Pending {
      std::uint32_t node;
      float lo, hi;
    };
    Pending stack[PlaneNodes<Plane>::kMostDepth];
    int top = 0;
    Mailbox mailbox;
    // The part of the ray within the cell; ends that are NaN bound nothing.
    Pending at{0, span.lo > ray.t_min ? span.lo : ray.t_min, span.hi < limit ? span.hi : limit};
    while (true) {
      const auto& node = tree_.nodes[at.node];
      if (node.count == PlaneNodes<Plane>::kInner) {
        const Crossing crossing = crosser.cross(node.plane);
        const std::uint32_t near = node.first + (crossing.is_descending ? 1 : 0);
        const std::uint32_t far = node.first + (crossing.is_descending ? 0 : 1);
        const bool visits_near = !(crossing.exit < at.lo), visits_far = !(crossing.entry > at.hi);
        tally.volume(visits_near);
        tally.volume(visits_far);
        if (visits_near) {
          if (visits_far) stack[top++] = {far, crossing.entry > at.lo ? crossing.entry : at.lo, at.hi};
          at = {near, at.lo, crossing.exit < at.hi ? crossing.exit : at.hi};
          continue;
        }
        if (visits_far) {
          at.node = far;
          at.lo = crossing.entry > at.lo ? crossing.entry : at.lo;
          continue;
        }
      } else if (node.count > 0) {
        const auto hits_before = tally.hits();
        bool any = false;
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
          if (mailbox.met(tree_.items[i])) continue;
          any = true;
          limit = leaf(tree_.items[i], limit);
          if (limit == kStop) return;
        }
        if (any) tally.looked_into(hits_before);
      }
      do {
        if (top == 0) return;
        --top;
      } while (stack[top].lo > limit);
      at = stack[top];
    }
  }

  AccelStats stats() const {
    return {tree_.nodes.size() * sizeof(tree_.nodes[0]) + tree_.items.size() * sizeof(std::uint32_t),
            tree_.nodes.size(), tree_.leaves, tree_.depth};
  }

 private:
  PlaneNodes<Plane> tree_;
};

PlaneNodes<AxisPlane> build_octree(const Items& items, const AccelOptions& options);
PlaneNodes<AxisPlane> build_kd(const Items& items, const AccelOptions& options);
PlaneNodes<FreePlane> build_bsp(const Items& items, const AccelOptions& options);

}  // namespace tessera

#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/accel/accel.h"
#include "core/bounds/aabb.h"
#include "core/bounds/cull_ray.h"

namespace tessera {

/// A binary hierarchy of boxes over items that it knows by box and number alone. Built by binned SAH (Wald, "On
/// fast Construction of SAH-based Bounding Volume Hierarchies", 2007). Depth ≤ `kMaxDepth`, whatever the input.
class BoxTree {
 public:
  /// Whether visiting may leave items out; `LinearIndex` may not.
  static constexpr bool kCulls = true;

  /// Items with an empty box are left out: nothing can hit them.
  explicit BoxTree(std::span<const Aabb> boxes);

  /// The box of all items; empty when there are none.
  Aabb root() const { return nodes_.empty() ? Aabb{} : nodes_[0].box; }

  /// Calls `leaf(item, limit)` for every item that `ray` may hit at t ≤ limit, roughly from near to far. It returns
  /// the new limit: lower after a hit, `kStop` to end the visit.
  template <typename Leaf>
  void visit(const CullRay& ray, float t_min, float limit, Leaf&& leaf) const;

  AccelStats stats() const;

 private:
  /// 32 bytes. An inner node's children are `first` and `first + 1`; a leaf's items are `count` from `first` on.
  struct Node {
    Aabb box;
    std::uint32_t first;
    std::uint32_t count;  ///< 0 for an inner node.
  };
  friend class BoxTreeBuilder;
  static constexpr int kMaxDepth = 96;

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> items_;
  std::uint32_t depth_ = 0;
  std::uint64_t leaves_ = 0;
};

/// Returned by a leaf to end a visit: no entry lies before it.
inline constexpr float kStop = -kInfinity;

template <typename Leaf>
void BoxTree::visit(const CullRay& ray, float t_min, float limit, Leaf&& leaf) const {
  if (nodes_.empty()) return;
  struct Pending {
    std::uint32_t node;
    float entry;
  };
  Pending stack[kMaxDepth];
  int top = 0;
  const auto missed = [&](Interval span) { return CullRay::misses(span, t_min, limit); };
  if (missed(ray.clip(nodes_[0].box))) return;
  std::uint32_t current = 0;
  while (true) {
    const Node& node = nodes_[current];
    if (node.count != 0) {
      for (std::uint32_t i = 0; i < node.count; ++i) {
        limit = leaf(items_[node.first + i], limit);
        if (limit == kStop) return;
      }
    } else {
      std::uint32_t near = node.first, far = node.first + 1;
      Interval near_span = ray.clip(nodes_[near].box), far_span = ray.clip(nodes_[far].box);
      if (far_span.lo < near_span.lo) {
        std::swap(near, far);
        std::swap(near_span, far_span);
      }
      const bool near_missed = missed(near_span), far_missed = missed(far_span);
      if (!near_missed) {
        if (!far_missed) stack[top++] = {far, far_span.lo};
        current = near;
        continue;
      }
      if (!far_missed) {
        current = far;
        continue;
      }
    }
    do {
      if (top == 0) return;
      --top;
    } while (stack[top].entry > limit);
    current = stack[top].node;
  }
}

}  // namespace tessera

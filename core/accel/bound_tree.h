#pragma once

#include <concepts>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/accel/accel.h"
#include "core/accel/build_stop.h"
#include "core/accel/index.h"
#include "core/accel/items.h"
#include "core/accel/topology.h"
#include "core/bounds/box_bound.h"

namespace tessera {

/// A binary hierarchy of bounding volumes, each fitted to the items below its node, not joined from its children's.
template <Bound B>
class BoundTree {
 public:
  using BoundType = B;
  static constexpr bool kCulls = true;
  static constexpr bool kHasRootVolume = true;

  BoundTree(const Items& items, const B& bound, const AccelOptions& options) : bound_(bound) {
    Topology topology = make_topology(items.boxes(), options.leaf_size, LeafRule::cheapest);
    depth_ = topology.depth;
    leaves_ = topology.leaves;
    items_ = std::move(topology.items);
    nodes_.reserve(topology.nodes.size());
    for (const Topology::Node& node : topology.nodes) nodes_.push_back({{}, node.first, node.count});
    if (nodes_.empty()) return;
    root_ = topology.nodes[0].box;
    if constexpr (std::same_as<B, BoxBound>)
      for (std::size_t i = 0; i < nodes_.size(); ++i) nodes_[i].volume = topology.nodes[i].box;
    else
      fit(0, items);
  }

  Aabb root() const { return root_; }

  /// Calls `leaf(item, limit)` for every item that `ray` may hit at t ≤ limit, roughly from near to far. It returns
  /// the new limit: lower after a hit, `kStop` to end the visit.
  template <typename Counter, typename Leaf>
  void visit(const Ray& ray, Transform::Error placed, float limit, Counter tally, Leaf&& leaf) const;

  AccelStats stats() const {
    std::uint64_t bytes = nodes_.size() * sizeof(Node) + items_.size() * sizeof(std::uint32_t);
    for (const Node& node : nodes_) bytes += bound_.bytes(node.volume);
    return {bytes, nodes_.size(), leaves_, depth_};
  }

 private:
  /// As in `Topology`. 32 bytes with boxes.
  struct Node {
    typename B::Volume volume;
    std::uint32_t first;
    std::uint32_t count;
  };

  /// Fits the volumes of a node and all below it; returns what decides the volumes above. Recurses as deep as the tree.
  Outline fit(std::uint32_t at, const Items& items) {
    BuildStop::check();
    Outline outline;
    Node& node = nodes_[at];
    if (node.count == 0) {
      outline = fit(node.first, items);
      outline.append(fit(node.first + 1, items));
    } else {
      for (std::uint32_t i = 0; i < node.count; ++i) items.outline(items_[node.first + i], outline);
    }
    node.volume = bound_.fit(outline);
    return outline;
  }

  B bound_;
  Aabb root_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> items_;
  std::uint32_t depth_ = 0;
  std::uint64_t leaves_ = 0;
};

template <Bound B>
template <typename Counter, typename Leaf>
void BoundTree<B>::visit(const Ray& ray, Transform::Error placed, float limit, Counter tally, Leaf&& leaf) const {
  if (nodes_.empty()) return;
  struct Pending {
    std::uint32_t node;
    float entry;
  };
  Pending stack[Topology::kMostDepth];
  int top = 0;
  const auto clipper = bound_.clipper(ray, root_, placed);
  const auto missed = [&](Interval span) {
    const bool misses = CullRay::misses(span, ray.t_min, limit);
    tally.volume(!misses);
    return misses;
  };
  if (missed(clipper.clip(nodes_[0].volume))) return;
  std::uint32_t current = 0;
  while (true) {
    const Node& node = nodes_[current];
    if (node.count != 0) {
      const auto hits_before = tally.hits();
      for (std::uint32_t i = 0; i < node.count; ++i) {
        limit = leaf(items_[node.first + i], limit);
        if (limit == kStop) return;
      }
      tally.looked_into(hits_before);
    } else {
      std::uint32_t near = node.first, far = node.first + 1;
      Interval near_span = clipper.clip(nodes_[near].volume), far_span = clipper.clip(nodes_[far].volume);
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

#pragma once

#include <cmath>
#include <concepts>
#include <cstdint>
#include <vector>

#include "core/accel/accel.h"
#include "core/accel/index.h"
#include "core/accel/items.h"
#include "core/accel/topology.h"
#include "core/bounds/box_bound.h"
#include "core/bounds/cull_ray.h"

namespace tessera {

/// A flat list of bounding volumes, each around a group of items that lie together.
template <Bound B>
class BoundList {
 public:
  using BoundType = B;
  static constexpr bool kCulls = true;
  static constexpr bool kHasRootVolume = false;

  BoundList(const Items& items, const B& bound, const AccelOptions& options) : bound_(bound) {
    std::uint32_t group_size = options.group_size;
    if (group_size == 0)
      group_size = items.are_primitives() ? static_cast<std::uint32_t>(std::ceil(std::sqrt(items.size()))) : 1;
    // An object by itself that is enclosed in its own space needs no second volume in the world's.
    is_clipped_ = items.are_primitives() || options.space == BoundSpace::world || group_size > 1;
    Topology topology = make_topology(items.boxes(), group_size, LeafRule::fullest);
    items_ = std::move(topology.items);
    if (!topology.nodes.empty()) root_ = topology.nodes[0].box;
    for (const Topology::Node& node : topology.nodes) {
      if (node.count == 0) continue;
      groups_.push_back({{}, node.first, node.count});
      if (!is_clipped_) continue;
      if constexpr (std::same_as<B, BoxBound>)
        groups_.back().volume = node.box;
      else
        groups_.back().volume = fit_around(bound_, items, std::span(items_).subspan(node.first, node.count));
    }
  }

  Aabb root() const { return root_; }

  /// As `BoundTree::visit`, in no order.
  template <typename Counter, typename Leaf>
  void visit(const Ray& ray, Transform::Error placed, float limit, Counter tally, Leaf&& leaf) const {
    if (groups_.empty()) return;
    const auto clipper = bound_.clipper(ray, root_, placed);
    for (const Group& group : groups_) {
      if (is_clipped_) {
        const bool misses = CullRay::misses(clipper.clip(group.volume), ray.t_min, limit);
        tally.volume(!misses);
        if (misses) continue;
      }
      const auto hits_before = tally.hits();
      for (std::uint32_t i = 0; i < group.count; ++i) {
        limit = leaf(items_[group.first + i], limit);
        if (limit == kStop) return;
      }
      if (is_clipped_) tally.looked_into(hits_before);
    }
  }

  AccelStats stats() const {
    std::uint64_t bytes = groups_.size() * sizeof(Group) + items_.size() * sizeof(std::uint32_t);
    for (const Group& group : groups_) bytes += bound_.bytes(group.volume);
    return {bytes, groups_.size(), groups_.size(), groups_.empty() ? 0U : 1U};
  }

 private:
  struct Group {
    typename B::Volume volume;
    std::uint32_t first;
    std::uint32_t count;
  };

  B bound_;
  Aabb root_;
  bool is_clipped_ = true;
  std::vector<Group> groups_;
  std::vector<std::uint32_t> items_;
};

}  // namespace tessera

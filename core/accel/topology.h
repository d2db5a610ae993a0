#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/bounds/aabb.h"

namespace tessera {

/// Which items share a node: a binary tree, whatever volumes are fitted to its nodes later. Built top-down by binned
/// SAH (Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", 2007).
struct Topology {
  /// An inner node's children are `first` and `first + 1`; a leaf's items are `items[first]` and the `count − 1` after.
  struct Node {
    Aabb box;
    std::uint32_t first;
    std::uint32_t count;  ///< 0 for an inner node.
  };

  std::vector<Node> nodes;  ///< Parents before children; none without items.
  std::vector<std::uint32_t> items;
  std::uint32_t depth = 0;  ///< ≤ `kMostDepth`, whatever the input.
  std::uint64_t leaves = 0;

  static constexpr int kMostDepth = 96;
};

/// When a node becomes a leaf.
enum class LeafRule {
  cheapest,  ///< With at most `leaf_size` items, where splitting wouldn't pay by the SAH.
  fullest,   ///< With at most `leaf_size` items, always.
};

/// Items with an empty box are left out. `leaf_size` ≥ 1.
Topology make_topology(std::span<const Aabb> boxes, std::uint32_t leaf_size, LeafRule rule);

}  // namespace tessera

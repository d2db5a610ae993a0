#pragma once

#include <bit>
#include <cstdint>

#include "core/accel/wide/lanes.h"

namespace tessera {

/// A node of the binary tree that a wide one is collapsed from. In the fourth lane of `lo` stands where an inner node's
/// two children, or a leaf's triangle numbers, begin; in that of `hi` a leaf's count, or an inner node's plan
/// (collapse.h).
struct BinaryNode {
  static constexpr std::uint32_t kLeaf = 1U << 31;
  /// In a plan: an inner node of the tree's top, below which there is work for several threads.
  static constexpr std::uint32_t kTop = 1U << 30;

  Lanes lo, hi;

  static BinaryNode leaf(const LanesBox& box, std::uint32_t first, std::uint32_t count) {
    return inner(box, first, kLeaf | count);
  }
  static BinaryNode inner(const LanesBox& box, std::uint32_t children, std::uint32_t plan) {
    BinaryNode node{box.lo, box.hi};
    node.lo[3] = std::bit_cast<float>(children);
    node.hi[3] = std::bit_cast<float>(plan);
    return node;
  }

  std::uint32_t first() const { return std::bit_cast<std::uint32_t>(lo[3]); }
  std::uint32_t plan() const { return std::bit_cast<std::uint32_t>(hi[3]); }
  bool is_leaf() const { return plan() & kLeaf; }
  bool is_top() const { return !is_leaf() && (plan() & kTop); }
  std::uint32_t count() const { return plan() & ~kLeaf; }
  LanesBox box() const { return {lo, hi}; }
};

}  // namespace tessera

#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/accel/accel.h"
#include "core/bounds/aabb.h"

namespace tessera {

/// A node of eight children, in two cache lines. Their boxes are kept in bytes, on a lattice that spans the node
/// (after Ylitie, Karras & Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", 2017),
/// with the orders in which rays of each octant meet them (Fuetterling et al., "Accelerated Single Ray Tracing for Wide
/// Vector Units", 2017).
///
/// Child i's box is [origin + lo[.][i] · step, origin + hi[.][i] · step] along each axis, taken exactly, and holds what
/// lies below it, taken exactly. Slots without a child come last; theirs is `kNoChild`, and their box is that of slot
/// 0.
struct alignas(64) WideNode {
  static constexpr int kChildren = 8;

  float origin[3];
  float step[3];  ///< > 0, finite.
  std::uint8_t lo[3][kChildren];
  std::uint8_t hi[3][kChildren];
  std::uint32_t child[kChildren];
  /// For rays of each octant (bit a set: they run downwards along axis a), its children from near to far: eight numbers
  /// of three bits, the nearest lowest, in 24 bits, the lowest byte first.
  std::uint8_t order[8][3];
};
static_assert(sizeof(WideNode) == 128);

/// What a child is: an inner node's number; or, with the highest bit set, a leaf of `count` triangles, `at` quads of
/// words into the tree's leaves.
struct WideChild {
  static constexpr std::uint32_t kLeaf = 1U << 31;
  static constexpr int kCountBits = 4;
  static constexpr std::uint32_t kMostInLeaf = 8;
  static constexpr std::uint32_t kMostQuads = 1U << (31 - kCountBits);

  static constexpr std::uint32_t leaf(std::uint32_t at, std::uint32_t count) {
    return kLeaf | at << kCountBits | count;
  }
  static constexpr bool is_leaf(std::uint32_t child) { return child & kLeaf; }
  static constexpr std::uint32_t count(std::uint32_t leaf) { return leaf & ((1U << kCountBits) - 1); }
  static constexpr std::uint32_t at(std::uint32_t leaf) { return (leaf & ~kLeaf) >> kCountBits; }
};

/// A leaf of no triangles.
inline constexpr std::uint32_t kNoChild = WideChild::leaf(0, 0);

/// A hierarchy over the triangles of one mesh, ready for rays: plain arrays without pointers, which can stand in a
/// mapped file. A triangle may stand in several leaves (Stich, Friedrich & Dietrich, "Spatial Splits in Bounding Volume
/// Hierarchies", 2009).
///
/// A leaf of n triangles is 10n words, rounded up to whole quads of them: nine rows of n floats, a.x a.y a.z b.x b.y
/// b.z c.x c.y c.z; n triangle numbers. So a vector of a row's values is one load; what it reads behind the row's end
/// means nothing. `kSlack` words behind the last leaf may be read.
struct WideTree {
  static constexpr std::uint32_t kSlack = 16;
  /// Levels of nodes at most, whatever the input.
  static constexpr int kMostDepth = 64;

  Aabb root;  ///< Of all triangles; empty without any, and then there are no nodes.
  std::span<const WideNode> nodes;
  std::span<const std::uint32_t> leaves;
  AccelStats stats;
  std::shared_ptr<const void> storage;  ///< Keeps what the spans show.
};

/// Words that a leaf of `count` triangles takes.
constexpr std::uint32_t leaf_words(std::uint32_t count) { return (10 * count + 3) / 4 * 4; }

}  // namespace tessera

#pragma once

#include <cstdint>
#include <vector>

#include "core/bounds/pixel_rect.h"
#include "core/screen/screen_parts.h"

namespace tessera {

/// A hierarchy of projected areas: its leaves hold parts of objects, its inner nodes the rectangle around what is
/// below. Immutable once made; safe to ask from any thread.
class ScreenTree {
 public:
  explicit ScreenTree(std::vector<ScreenPart> parts);

  /// The objects of which a part overlaps `rect`, each once, ascending; of more than `most`, only the first
  /// `most` + 1 that were found.
  std::vector<std::uint32_t> objects_in(PixelRect rect, std::size_t most) const;

  /// Whether parts cover at least half of `rect`, which is not empty, as far as an 8 × 8 grid over it shows: a cell
  /// that a part overlaps counts as covered.
  bool covers_half(PixelRect rect) const;

 private:
  struct Node {
    PixelRect area;
    std::uint32_t first = 0;  ///< Of the parts of a leaf, or of the two children.
    std::uint32_t count = 0;  ///< Of parts; 0 in an inner node.
  };

  void build(std::uint32_t node, std::uint32_t begin, std::uint32_t end);

  /// Calls `take(part)` for the parts below `node` that overlap `rect` until it returns false; whether it never did.
  template <typename Take>
  bool visit(std::uint32_t node, PixelRect rect, Take&& take) const;

  std::vector<ScreenPart> parts_;
  std::vector<Node> nodes_;  ///< The root first; none without parts.
};

}  // namespace tessera

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/bounds/pixel_rect.h"

namespace tessera {

/// Some of a pixel's samples, one after the other.
struct SampleRange {
  std::uint32_t first = 0, count = 0;

  std::uint32_t end() const { return first + count; }
  bool operator==(const SampleRange&) const = default;
};

/// What a pass over an image renders: of every pixel the samples that its block is given. Blocks are squares of the
/// image, row by row, those at its right and bottom edge cut off; they have nothing to do with tiles.
struct Pass {
  static constexpr std::int32_t kBlock = 16;

  /// Of the same samples everywhere.
  Pass(std::uint32_t width, std::uint32_t height, SampleRange samples);

  std::int32_t columns() const { return (width + kBlock - 1) / kBlock; }
  std::int32_t rows() const { return (height + kBlock - 1) / kBlock; }
  PixelRect rect_of(std::size_t block) const;
  const SampleRange& of(std::int32_t x, std::int32_t y) const {
    return blocks[static_cast<std::size_t>(y / kBlock) * static_cast<std::size_t>(columns()) +
                  static_cast<std::size_t>(x / kBlock)];
  }

  /// Calls `use` with the part of each block that lies in `rect`, itself a part of the image, and the block's samples.
  template <typename Use>
  void for_blocks_in(PixelRect rect, Use&& use) const {
    for (std::int32_t y = rect.y0; y < rect.y1; y = (y / kBlock + 1) * kBlock)
      for (std::int32_t x = rect.x0; x < rect.x1; x = (x / kBlock + 1) * kBlock)
        use(PixelRect{x, y, std::min(rect.x1, (x / kBlock + 1) * kBlock), std::min(rect.y1, (y / kBlock + 1) * kBlock)},
            of(x, y));
  }

  /// Samples that it renders of the pixels of such a rectangle.
  std::uint64_t samples_in(PixelRect rect) const;

  std::int32_t width, height;
  std::vector<SampleRange> blocks;
};

}  // namespace tessera

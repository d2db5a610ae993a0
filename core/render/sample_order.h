#pragma once

#include <cstdint>
#include <vector>

#include "core/bounds/pixel_rect.h"
#include "core/sampling/sampler.h"

namespace tessera {

/// The samples of a rectangle in an order in which those close to each other are so in the picture too: squares of
/// 16 × 16 pixels, row by row; in each its pixels along Morton's curve ("A Computer Oriented Geodetic Data Base",
/// 1966); of each pixel all its samples. With one sample a pixel, whole sixteens are 4 × 4 pixels.
class SampleOrder {
 public:
  /// Precondition: `samples`, of each pixel, isn't 0.
  SampleOrder(PixelRect rect, std::uint32_t samples) : rect_(rect), samples_(samples), x0_(rect.x0), y0_(rect.y0) {}

  /// Fills `out` with the samples that come next, of so many pixels and so many together at most. False when there are
  /// none left.
  bool next(std::size_t most_samples, std::size_t most_pixels, std::vector<SampleId>& out);

 private:
  static constexpr std::int32_t kSquare = 16;

  void next_pixel();

  PixelRect rect_;
  std::uint32_t samples_;
  std::int32_t x0_, y0_;     ///< Of the square at hand.
  std::uint32_t along_ = 0;  ///< The curve in it.
  std::uint32_t index_ = 0;  ///< Of the pixel's samples.
};

}  // namespace tessera

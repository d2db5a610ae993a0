#pragma once

#include <cstdint>
#include <vector>

#include "core/bounds/pixel_rect.h"
#include "core/film/pass.h"
#include "core/sampling/sampler.h"

namespace tessera {

/// The samples of a rectangle in an order in which those close to each other are so in the picture too: squares of
/// 16 × 16 pixels, row by row; in each its pixels along Morton's curve ("A Computer Oriented Geodetic Data Base",
/// 1966); of each pixel all that a pass renders. With one sample a pixel, whole sixteens are 4 × 4 pixels.
class SampleOrder {
 public:
  /// The rectangle lies in the image of the pass, which has to outlive this.
  SampleOrder(PixelRect rect, const Pass& pass) : rect_(rect), pass_(pass), x0_(rect.x0), y0_(rect.y0) {}

  /// Fills `out` with the samples that come next, of so many pixels and so many together at most. False when there are
  /// none left.
  bool next(std::size_t most_samples, std::size_t most_pixels, std::vector<SampleId>& out);

 private:
  static constexpr std::int32_t kSquare = 16;

  void next_pixel();

  PixelRect rect_;
  const Pass& pass_;
  std::int32_t x0_, y0_;     ///< Of the square at hand.
  std::uint32_t along_ = 0;  ///< The curve in it.
  std::uint32_t done_ = 0;   ///< Of the pixel's samples in the pass.
};

}  // namespace tessera

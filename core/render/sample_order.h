#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
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
  SampleOrder(PixelRect rect, const Pass& pass);

  /// Fills `out` with the samples that come next, of so many pixels and so many together at most. False when there are
  /// none left.
  bool next(std::size_t most_samples, std::size_t most_pixels, std::vector<SampleId>& out);

  /// Gives away the latter half of what is left, in whole pixels. Nothing where that would be less than so many
  /// samples.
  std::optional<SampleOrder> split(std::uint64_t least_samples);

 private:
  static constexpr std::int32_t kSquare = 16;
  static constexpr std::uint64_t kPlaces = kSquare * kSquare;

  // Places are counted along the way, in squares that are whole: some lie outside the rectangle.
  void go_to(std::uint64_t place);
  /// The part of a place's square that lies in the rectangle.
  PixelRect square(std::uint64_t place) const;
  std::uint64_t samples_at(std::uint64_t place) const;

  PixelRect rect_;
  const Pass& pass_;
  std::int32_t columns_;     ///< Of squares.
  std::uint64_t place_ = 0;  ///< Of the pixel at hand.
  std::uint64_t end_;
  PixelRect square_;
  std::uint32_t done_ = 0;  ///< Of the pixel's samples in the pass.
};

}  // namespace tessera

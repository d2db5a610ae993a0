#pragma once

#include <cstddef>
#include <vector>

#include "core/sampling/pixel_samples.h"
#include "core/scene/settings.h"

namespace tessera {

/// A separable reconstruction filter that is sampled: a pixel's samples fall where the filter is, as densely as it is
/// high, and all count alike (filter importance sampling; Ernst, Stamminger & Greiner 2006). So a sample belongs to one
/// pixel (law L4), and what is constant stays so to the bit. Immutable; safe to use from any thread.
///
/// Widths are in pixels, as Blender's users give them; default in brackets, which is what 0 stands for:
/// - `box` [1]: the side of the square.
/// - `gaussian` [1.5]: 4 standard deviations, where it is cut off on each side.
/// - `blackman_harris` [1.5]: how far the four-term window (Harris 1978) reaches to each side.
class PixelFilter {
 public:
  PixelFilter(FilterKind kind, float width);

  /// Where a sample falls whose numbers are `u`, in [0, 1)²: in pixels from the pixel's top left corner; beside the
  /// pixel if the filter is that wide. The middle stays the middle, and for a box of width 1 all stays as it is.
  PixelOffset sample(PixelOffset u) const;

  /// How far from the pixel's centre samples can fall, in pixels, along each axis.
  double reach() const { return reach_; }

 private:
  double invert(double u) const;

  double reach_;
  // On [0, 1], in equal steps, one side of the filter as a density with straight pieces, and its integral. None: a box.
  std::vector<double> density_, integral_;
};

}  // namespace tessera

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>
#include <vector>

#include "core/film/pass.h"
#include "core/film/pixels.h"
#include "core/scene/settings.h"

namespace tessera {

/// What the samples of each pixel of a rectangle have come to so far, and all that it takes to go on. Samples are added
/// in the order of their indices, so that it doesn't matter in how many passes that is done.
struct Sums {
  Sums(PixelRect rect, const Settings& settings);

  /// Colour, and the AOVs that are means, not yet divided by the number of samples. Colour is that of replicate 0 where
  /// there are two.
  Pixels totals;
  std::vector<Rgb> second;  ///< Colour of replicate 1; empty where there is one.
  /// How much of what lies behind shows through the samples of either replicate. The error of a transparent image is
  /// that of the image laid on white: a shadow on nothing is black throughout, and would have none. Empty for others.
  std::array<std::vector<float>, 2> clear;
  /// The mean of the samples' colours, and the sum of the squares of their distances from it (Welford 1962: that of two
  /// sums of squares would lose most of its digits). Empty unless the variance is recorded.
  std::vector<Rgb> mean, squares;

  const PixelRect& rect() const { return totals.rect; }
  /// `covered`, 0 to 1, is how much of what lies behind a sample hides.
  void add(std::size_t pixel, std::uint32_t sample, Rgb color, float covered = 1);
  /// Adds to the sum of an AOV that is a mean, if it is recorded. Precondition: T is the type of its values.
  template <typename T>
  void add(Aov aov, std::size_t pixel, const T& value) {
    if (std::vector<T>& sums = totals.plane<T>(aov); !sums.empty()) sums[pixel] = sums[pixel] + value;
  }
  /// Adds to all pixels of a rectangle, whose samples have been alike so far, samples that are so too. However many
  /// they are, that takes 2^25 additions at most: then a sum of floats doesn't grow any more.
  void add_equal(PixelRect where, SampleRange samples, Rgb color, float covered = 1);
  /// Takes those of a rectangle from others that have it.
  void copy(const Sums& from, PixelRect where);

  static std::uint64_t bytes_per_pixel(const Settings& settings);
};

/// What a pass asks of a tile, and what the passes before it have come to there.
struct PassWork {
  /// Of a tile that has had none.
  PassWork(std::shared_ptr<const Pass> pass, PixelRect tile, const Settings& settings);

  std::shared_ptr<const Pass> pass;
  Pixels pixels;
  Sums sums;
};

/// What pixels are whose samples up to the end of those of `pass` have been summed. Of one sample, the variance is told
/// as 0.
void resolve(const Sums& sums, const Pass& pass, Pixels& out);

}  // namespace tessera

#pragma once

#include <cstdint>

namespace tessera {

/// Uniform in [0, 1), a pure function of its arguments (law L3): nothing is carried from draw to draw.
double uniform(std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint32_t sample, std::uint32_t dimension);

/// Where in its pixel a sample falls.
struct PixelOffset {
  double x, y;  ///< In [0, 1).
};

/// Where the samples of an image's pixels fall, each pixel having `count`: sample i is jittered within its cell of a
/// columns × rows = count grid as square as the count's divisors allow (Cook 1986), further samples within the same
/// cells again. Without `jitter`, at the pixel's centre. Pure.
class PixelOffsets {
 public:
  PixelOffsets(std::uint64_t seed, std::uint32_t count, bool jitter);

  PixelOffset of(std::uint32_t x, std::uint32_t y, std::uint32_t sample) const;
  /// The same for the pixel that these `pixel_bits` stand for, but in sample `cell`'s cell.
  PixelOffset in_cell(std::uint64_t pixel, std::uint32_t sample, std::uint32_t cell) const;

 private:
  std::uint64_t mixed_seed_;
  std::uint32_t across_, down_;
  bool jitter_;
};

}  // namespace tessera

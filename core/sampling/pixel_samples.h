#pragma once

#include <cstdint>

namespace tessera {

/// Uniform in [0, 1), a pure function of its arguments (law L3): nothing is carried from draw to draw.
double uniform(std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint32_t sample, std::uint32_t dimension);

/// Where in its pixel a sample falls.
struct PixelOffset {
  double x, y;  ///< In [0, 1).
};

/// Sample `sample` of `count`: jittered within its cell of a columns × rows = count grid as square as the count's
/// divisors allow (Cook 1986). Without `jitter`, the pixel's centre.
PixelOffset pixel_offset(std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint32_t sample,
                         std::uint32_t count, bool jitter);

}  // namespace tessera

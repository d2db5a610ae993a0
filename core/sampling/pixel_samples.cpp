#include "core/sampling/pixel_samples.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

/// The finalizer of SplitMix64 (Steele, Lea & Flood, OOPSLA 2014): every input bit reaches every output bit.
constexpr std::uint64_t mix(std::uint64_t z) {
  z += 0x9E3779B97F4A7C15ULL;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

std::uint32_t columns(std::uint32_t count) {
  auto n = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(count)));
  while (count % n != 0) --n;
  return count / n;
}

}  // namespace

double uniform(std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint32_t sample, std::uint32_t dimension) {
  const std::uint64_t pixel = mix(mix(seed) ^ (std::uint64_t{y} << 32 | x));
  return static_cast<double>(mix(pixel ^ (std::uint64_t{dimension} << 32 | sample)) >> 11) * 0x1p-53;
}

PixelOffset pixel_offset(std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint32_t sample,
                         std::uint32_t count, bool jitter) {
  if (!jitter) return {0.5, 0.5};
  const std::uint32_t across = columns(count), down = count / across;
  // The sum is < 1 before rounding; the largest double below 1 keeps it there after.
  const auto within = [](std::uint32_t cell, double offset, std::uint32_t cells) {
    return std::min((cell + offset) / cells, 1 - 0x1p-53);
  };
  return {within(sample % across, uniform(seed, x, y, sample, 0), across),
          within(sample / across, uniform(seed, x, y, sample, 1), down)};
}

}  // namespace tessera

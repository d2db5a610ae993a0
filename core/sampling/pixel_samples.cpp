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

/// What all numbers of a pixel come from.
std::uint64_t pixel_bits(std::uint64_t seed, std::uint32_t x, std::uint32_t y) {
  return mix(mix(seed) ^ (std::uint64_t{y} << 32 | x));
}

double uniform_of(std::uint64_t pixel, std::uint32_t sample, std::uint32_t dimension) {
  return static_cast<double>(mix(pixel ^ (std::uint64_t{dimension} << 32 | sample)) >> 11) * 0x1p-53;
}

/// In [0, 1). The sum is < cells before rounding; the largest double below 1 keeps it there after.
double within(std::uint32_t cell, double offset, std::uint32_t cells) {
  return std::min((cell + offset) / cells, 1 - 0x1p-53);
}

}  // namespace

double uniform(std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint32_t sample, std::uint32_t dimension) {
  return uniform_of(pixel_bits(seed, x, y), sample, dimension);
}

PixelOffsets::PixelOffsets(std::uint64_t seed, std::uint32_t count, bool jitter)
    : seed_(seed), across_(columns(count)), down_(count / across_), jitter_(jitter) {}

PixelOffset PixelOffsets::of(std::uint32_t x, std::uint32_t y, std::uint32_t sample) const {
  if (!jitter_) return {0.5, 0.5};
  const std::uint64_t pixel = pixel_bits(seed_, x, y);
  return {within(sample % across_, uniform_of(pixel, sample, 0), across_),
          within(sample / across_, uniform_of(pixel, sample, 1), down_)};
}

}  // namespace tessera

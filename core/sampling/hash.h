#pragma once

#include <cstdint>

namespace tessera {

/// The finalizer of SplitMix64 (Steele, Lea & Flood, OOPSLA 2014): every input bit reaches every output bit.
constexpr std::uint64_t mix(std::uint64_t z) {
  z += 0x9E3779B97F4A7C15ULL;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

/// What all numbers of a pixel come from. `mixed_seed` is mix(seed).
constexpr std::uint64_t pixel_bits(std::uint64_t mixed_seed, std::uint32_t x, std::uint32_t y) {
  return mix(mixed_seed ^ (std::uint64_t{y} << 32 | x));
}

/// A dimension of one of the pixel's samples, as 64 random bits.
constexpr std::uint64_t sample_bits(std::uint64_t pixel, std::uint32_t sample, std::uint32_t dimension) {
  return mix(pixel ^ (std::uint64_t{dimension} << 32 | sample));
}

}  // namespace tessera

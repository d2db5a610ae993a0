#include "core/sampling/pixel_samples.h"

#include <algorithm>
#include <cmath>

#include "core/sampling/hash.h"

namespace tessera {
namespace {

std::uint32_t columns(std::uint32_t count) {
  auto n = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(count)));
  while (count % n != 0) --n;
  return count / n;
}

double uniform_of(std::uint64_t pixel, std::uint32_t sample, std::uint32_t dimension) {
  return static_cast<double>(sample_bits(pixel, sample, dimension) >> 11) * 0x1p-53;
}

/// In [0, 1). The sum is < cells before rounding; the largest double below 1 keeps it there after.
double within(std::uint32_t cell, double offset, std::uint32_t cells) {
  return std::min((cell + offset) / cells, 1 - 0x1p-53);
}

}  // namespace

double uniform(std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint32_t sample, std::uint32_t dimension) {
  return uniform_of(pixel_bits(mix(seed), x, y), sample, dimension);
}

PixelOffsets::PixelOffsets(std::uint64_t seed, std::uint32_t count, bool jitter)
    : mixed_seed_(mix(seed)), across_(columns(count)), down_(count / across_), jitter_(jitter) {}

PixelOffset PixelOffsets::of(std::uint32_t x, std::uint32_t y, std::uint32_t sample) const {
  return in_cell(pixel_bits(mixed_seed_, x, y), sample, sample);
}

PixelOffset PixelOffsets::in_cell(std::uint64_t pixel, std::uint32_t sample, std::uint32_t cell) const {
  if (!jitter_) return {0.5, 0.5};
  return {within(cell % across_, uniform_of(pixel, sample, 0), across_),
          within(cell / across_ % down_, uniform_of(pixel, sample, 1), down_)};
}

}  // namespace tessera

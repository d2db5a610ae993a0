#include "core/sampling/sampler.h"

#include <algorithm>

#include "core/sampling/hash.h"

namespace tessera {
namespace {

/// The order of all bits turned round: of the bytes, then within each.
template <class T>
constexpr T reversed(T v) {
  constexpr auto kAll = static_cast<T>(-1);
  if constexpr (sizeof(T) == 8)
    v = __builtin_bswap64(v);
  else
    v = __builtin_bswap32(v);
  v = (v & kAll / 17) << 4 | (v >> 4 & kAll / 17);   // 0x0F0F…
  v = (v & kAll / 5) << 2 | (v >> 2 & kAll / 5);     // 0x3333…
  return (v & kAll / 3) << 1 | (v >> 1 & kAll / 3);  // 0x5555…
}

/// Owen's nested scrambling of a number whose bits are reversed: whether a bit flips is a hash of those below it. The
/// hash is of Laine & Karras' kind (2011, Stratified Sampling for Stochastic Transparency) with the steps and constants
/// of Vegdahl 2021, "Building a Better LK Hash", which scramble the better; `seed` has to be random itself.
constexpr std::uint32_t scrambled(std::uint32_t v, std::uint32_t seed) {
  v ^= v * 0x3D20ADEA;
  v += seed;
  v *= seed >> 16 | 1;
  v ^= v * 0x05526C56;
  v ^= v * 0x53A22864;
  return v;
}

/// The second dimension of Sobol's sequence, its bits reversed; the first is the index itself. Its matrix is Pascal's
/// triangle modulo 2, where the entry of column k and row r is odd when r's bits are among k's (Lucas 1878): so a
/// product with it is five sums over one bit of k each.
constexpr std::uint32_t second_dimension(std::uint32_t index) {
  index ^= index >> 1 & 0x55555555;
  index ^= index >> 2 & 0x33333333;
  index ^= index >> 4 & 0x0F0F0F0F;
  index ^= index >> 8 & 0x00FF00FF;
  index ^= index >> 16;
  return index;
}

/// The middle of one of 2^23 intervals.
constexpr float to_unit(std::uint32_t bits) { return static_cast<float>(bits >> 8 | 1) * 0x1p-24F; }

constexpr std::uint32_t low(std::uint64_t bits) { return static_cast<std::uint32_t>(bits); }
constexpr std::uint32_t high(std::uint64_t bits) { return static_cast<std::uint32_t>(bits >> 32); }

}  // namespace

float PathSample::one(Dimension dimension) const {
  if (!sobol_) return to_unit(high(sample_bits(pixel_, number_, dimension.index)));
  const std::uint64_t seeds = sample_bits(pixel_, 0, dimension.index);
  const std::uint32_t index = reversed(scrambled(reversed_, low(seeds)));
  return to_unit(reversed(scrambled(index, high(seeds))));
}

Vec2 PathSample::two(Dimension dimension) const {
  if (!sobol_) {
    const std::uint64_t bits = sample_bits(pixel_, number_, dimension.index);
    return {to_unit(high(bits)), to_unit(low(bits))};
  }
  const std::uint64_t seeds = sample_bits(pixel_, 0, dimension.index);
  const std::uint32_t index = reversed(scrambled(reversed_, low(seeds)));
  const std::uint32_t x = scrambled(index, high(seeds));
  const std::uint32_t y = scrambled(second_dimension(index), high(seeds * 0xD1342543DE82EF95));
  const std::uint64_t both = reversed(std::uint64_t{y} << 32 | x);
  return {to_unit(high(both)), to_unit(low(both))};
}

Sampler::Sampler(const Options& options)
    : kind_(options.kind),
      jitter_(options.jitter),
      replicates_(options.replicates),
      mixed_seed_(mix(options.seed)),
      cells_(std::max(options.samples / options.replicates, 1U)),
      grid_(options.seed, cells_, options.jitter) {}

PathSample Sampler::at(SampleId id) const {
  const std::uint32_t replicate = id.index % replicates_;
  PathSample sample;
  sample.pixel_ = pixel_bits(replicate == 0 ? mixed_seed_ : mix(mixed_seed_ ^ replicate),
                             static_cast<std::uint32_t>(id.x), static_cast<std::uint32_t>(id.y));
  sample.number_ = id.index / replicates_;
  sample.reversed_ = reversed(sample.number_);
  sample.sobol_ = kind_ == SamplerKind::sobol;
  return sample;
}

PixelOffset Sampler::film(SampleId id) const {
  if (!jitter_) return {0.5, 0.5};
  const PathSample sample = at(id);
  if (kind_ == SamplerKind::grid) {
    // A replicate may end before its grid is full: each begins anywhere.
    const std::uint32_t first = replicates_ == 1 ? 0 : low(sample_bits(sample.pixel_, 0, kGridDimension.index));
    return grid_.in_cell(sample.pixel_, sample.number_, sample.number_ % cells_ + first % cells_);
  }
  const Vec2 u = sample.two(kFilmDimension);
  return {u.x, u.y};
}

}  // namespace tessera

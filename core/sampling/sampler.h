#pragma once

#include <cstdint>

#include "core/math/vec2.h"
#include "core/sampling/dimensions.h"
#include "core/sampling/pixel_samples.h"
#include "core/scene/settings.h"

namespace tessera {

/// A sample of a pixel.
struct SampleId {
  std::int32_t x, y;
  std::uint32_t index;  ///< Of the pixel's samples.

  constexpr bool operator==(const SampleId&) const = default;
};

/// The random numbers of one sample, for the path that it is. A few words, made anew from the sample's id or kept with
/// the path. Numbers are in (0, 1), floats of 23 bits whose mean is exactly ½: neither 0 nor 1 ever needs care.
class PathSample {
 public:
  /// Each a pure function of the sampler, the sample's id and the dimension.
  float one(Dimension dimension) const;
  Vec2 two(Dimension dimension) const;

 private:
  friend class Sampler;

  std::uint64_t pixel_;     ///< Seed, replicate and pixel, hashed.
  std::uint32_t number_;    ///< Of the replicate's samples in the pixel.
  std::uint32_t reversed_;  ///< Its bits reversed.
  bool sobol_;
};

/// A number in (0, 1) of 46 bits, from a pair of a sample's: one among a million lights of different power may have a
/// smaller share than 2^-23.
constexpr double joined(Vec2 pair) { return pair.x + (pair.y - 0.5) * 0x1p-23; }

/// Gives each sample its random numbers: pure functions of (seed, pixel, sample, dimension), from pixel to pixel
/// independent (law L3). Safe to use from any thread.
///
/// - `independent`: hashes.
/// - `sobol`: for each dimension, or pair of dimensions, the (first two) dimensions of Sobol's sequence (Sobol 1967),
///   with the order of samples shuffled and the values scrambled, both as Owen (1995) nests permutations, by hashes
///   (Burley 2020, Practical Hash-based Owen Scrambling, JCGT 9(4)): padding. Any first 2^k samples of a pixel are
///   stratified in all elementary intervals of each pair.
/// - `grid`: `PixelOffsets` on the film, otherwise hashes.
class Sampler {
 public:
  struct Options {
    SamplerKind kind = SamplerKind::sobol;  ///< Not `automatic`.
    std::uint64_t seed = 0;
    std::uint32_t samples = 1;     ///< Of a pixel, ≥ 1: what the grid is made for.
    bool jitter = true;            ///< Otherwise on the film all fall on the pixel's centre.
    std::uint32_t replicates = 1;  ///< ≥ 1: sample i is sample i / replicates of sequence i % replicates; the sequences
                                   ///< are independent of each other.
  };

  explicit Sampler(const Options& options);

  PathSample at(SampleId id) const;

  /// Where in its pixel the sample falls.
  PixelOffset film(SampleId id) const;

  float one(SampleId id, Dimension dimension) const { return at(id).one(dimension); }
  Vec2 two(SampleId id, Dimension dimension) const { return at(id).two(dimension); }

 private:
  SamplerKind kind_;
  bool jitter_;
  std::uint32_t replicates_;
  std::uint64_t mixed_seed_;
  std::uint32_t cells_;  ///< Of the grid, per replicate.
  PixelOffsets grid_;
};

}  // namespace tessera

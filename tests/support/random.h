#pragma once

#include <cmath>
#include <cstdint>

#include "core/math/vec.h"

namespace tessera {

/// Random test input that is the same with every compiler and library: seed = loop index, printed on failure.
/// SplitMix64 (Steele, Lea & Flood 2014).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ULL + 1) {}

  std::uint64_t bits() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15ULL;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31);
  }
  /// In [lo, hi).
  double uniform(double lo, double hi) { return lo + (hi - lo) * static_cast<double>(bits() >> 11) * 0x1p-53; }

  /// Every power of ten in the range equally likely.
  double magnitude(double lo_exponent, double hi_exponent) { return std::pow(10.0, uniform(lo_exponent, hi_exponent)); }

  Vec3d in_cube() { return {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}; }

  /// Evenly distributed, of length 1.
  Vec3d direction() {
    for (;;) {
      const Vec3d v = in_cube();
      const double l = length(v);
      if (l > 1e-3 && l <= 1) return v / l;
    }
  }

 private:
  std::uint64_t state_;
};

}  // namespace tessera

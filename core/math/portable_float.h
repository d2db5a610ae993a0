#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace tessera {

// Elementary functions of floats for what is done at every hit, with the same bits on every machine as those of
// portable.h (law L1). Each reduces its argument and sums a minimax polynomial (Remez's exchange; Muller 2016,
// Elementary Functions, ch. 3 and 11) in double, whose relative error is below 2^-33, and rounds to float once: so all
// are within 0.51 ulp of the exact value (0.51 denormal steps where the result is denormal). No branches but
// selections. Pure; NaN in, NaN out.

struct SinCos {
  float sin, cos;
};

namespace portable_detail {

/// Rounds to the nearest whole number when it is added, whose lowest bits are then the sum's. |x| < 2^51.
inline constexpr double kRounder = 0x1.8p52;

/// Sine and cosine of `quarters` · π/2 + r, |r| ≤ π/4; of `quarters` the two lowest bits count.
inline SinCos sin_cos(double r, std::uint64_t quarters) {
  const double z = r * r;
  const double sine = r + r * z *
                              (-0x1.5555554c71d1fp-3 +
                               z * (0x1.1111086a62a01p-7 + z * (-0x1.a00f7f29b9bb7p-13 + z * 0x1.6cd1f2e073adcp-19)));
  const double cosine = 1 + z * (-0x1.ffffffcb82f87p-2 +
                                 z * (0x1.55553c789a7e5p-5 + z * (-0x1.6c07f1694563fp-10 + z * 0x1.99169fbf33cd4p-16)));
  const bool odd = (quarters & 1) != 0;
  const double s = odd ? cosine : sine, c = odd ? sine : cosine;
  return {static_cast<float>((quarters & 2) != 0 ? -s : s), static_cast<float>(((quarters + 1) & 2) != 0 ? -c : c)};
}

/// The angle of (x, y) from the x axis, from -π to π; 0 for (0, 0).
inline double angle(double y, double x) {
  constexpr double kTanEighthPi = std::numbers::sqrt2 - 1;
  const double across = std::abs(x), up = std::abs(y);
  const bool steep = up > across;
  const double small = steep ? across : up, large = steep ? up : across;
  const bool far = small > kTanEighthPi * large;  // atan(s/l) = π/4 + atan((s - l) / (s + l))
  const double t = (far ? small - large : small) / ((far ? small + large : large) + 0x1p-1000);  // not 0/0
  const double z = t * t;
  const double rest =
      z * (-0x1.555554c6051fcp-2 +
           z * (0x1.999918a0cc6a1p-3 +
                z * (-0x1.247eda577bb25p-3 +
                     z * (0x1.c463fcda81df5p-4 + z * (-0x1.5b30240cb6b6ap-4 + z * 0x1.84a1fd9b6c9bdp-5)))));
  const double first = (far ? std::numbers::pi / 4 : 0) + (t + t * rest);
  const double half = steep ? std::numbers::pi / 2 - first : first;
  return std::copysign(x < 0 ? std::numbers::pi - half : half, y);
}

}  // namespace portable_detail

/// Sine and cosine of 2π · `turns`, |turns| ≤ 2^20; exactly 0 and ±1 at quarters of a turn.
inline SinCos sin_cos_turns(float turns) {
  const double quarters = 4.0 * turns, rounded = quarters + portable_detail::kRounder;
  return portable_detail::sin_cos((quarters - (rounded - portable_detail::kRounder)) * (std::numbers::pi / 2),
                                  std::bit_cast<std::uint64_t>(rounded));
}

/// Sine and cosine of an angle in radians, |radians| ≤ 2^16.
inline SinCos portable_sin_cos(float radians) {
  // π/2 in two parts (Cody & Waite): a multiple of the first, which has 33 bits, is exact.
  constexpr double kHalfPiHigh = 0x1.921fb544p+0, kHalfPiLow = 0x1.0b4611a626331p-34;
  const double rounded = radians * (2 / std::numbers::pi) + portable_detail::kRounder;
  const double n = rounded - portable_detail::kRounder;
  return portable_detail::sin_cos((radians - n * kHalfPiHigh) - n * kHalfPiLow, std::bit_cast<std::uint64_t>(rounded));
}

/// The angle of the point (x, y) from the x axis in radians, from -π to π, with the sign of y; 0 for (0, 0). NaN where
/// both are infinite.
inline float portable_atan2(float y, float x) { return static_cast<float>(portable_detail::angle(y, x)); }

/// The angle in [0, π], in radians, whose cosine is `x`; an `x` outside [-1, 1] counts as the nearer end.
inline float portable_acos(float x) {
  const double square = (1.0 - x) * (1.0 + x);
  return static_cast<float>(portable_detail::angle(std::sqrt(square < 0 ? 0 : square), x));
}

}  // namespace tessera

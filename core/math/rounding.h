#pragma once

#include <algorithm>
#include <limits>

namespace tessera {

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// u: the largest relative error of one correctly rounded float operation (2^-24). Higham 2002, ch. 2.
inline constexpr double kUnitRoundoff = 0x1p-24;

/// The smallest positive float (2^-149): the absolute error of a float operation whose result is denormal.
inline constexpr double kDenormalStep = 0x1p-149;

/// A float that is less (greater) than `x`: the greatest (least) one, or one up to two ulp further out. NaN stays NaN.
constexpr float below(double x) {
  const double less = x * (x > 0 ? 1 - 0x1p-23 : 1 + 0x1p-23) - kDenormalStep;
  return static_cast<float>(std::min(less, double{std::numeric_limits<float>::max()}));
}
constexpr float above(double x) { return -below(-x); }

}  // namespace tessera

#pragma once

#include <limits>

namespace tessera {

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// u: the largest relative error of one correctly rounded float operation (2^-24). Higham 2002, ch. 2.
inline constexpr double kUnitRoundoff = 0x1p-24;

/// The smallest positive float (2^-149): the absolute error of a float operation whose result is denormal.
inline constexpr double kDenormalStep = 0x1p-149;

}  // namespace tessera

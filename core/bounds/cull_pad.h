#pragma once

#include <algorithm>
#include <cmath>

#include "core/bounds/aabb.h"
#include "core/math/ray.h"
#include "core/math/transform.h"

namespace tessera {

/// How far, along each axis, a bound has to be pushed outward for this ray so that no hit inside is lost (law L2).
/// Hence |n|₁ times as far along a normal n, and √3 times as far along any unit vector.
///
/// What it covers. Let M be the largest coordinate distance from the ray's origin to a corner of `reach`, the box of
/// everything that will be tested, and u = 2^-24. Distances are along one axis.
///   1. A primitive's t is exact to one rounding (core/geometry computes in double): u·|t·d| ≤ uM along the axis.
///      What double leaves beside that is below 2^-30·M, uM/64 (core/geometry/double_root.h).
///   2. A direction component smaller than |d|·2^-26 is replaced by that, so that nothing divides by zero. A point
///      within M of the origin (t ≤ M/|d|∞) moves by at most M·2^-26 = uM/4.
///   3. The test of the bound. A plane's t in float is fl((plane − o) · fl(1/d)): three roundings, 3u·|plane − o| ≤
///   3uM.
///      The pad's own product and difference: 2u of the result, ≤ 2uM(1 + 8u). A test in double of a bound that fits
///      what it holds rounds some twenty times, of 2^-53 · 4M: that is less than uM/2^20.
/// That is less than 7uM; 8uM is the pad. Instances add the rounding of their transforms (`Transform::Error`).
inline double cull_pad(const Ray& ray, const Aabb& reach, Transform::Error placed = {}) {
  const double m = std::max(max_component(abs(to_double(reach.lo) - to_double(ray.origin))),
                            max_component(abs(to_double(reach.hi) - to_double(ray.origin))));
  const double o = max_component(abs(ray.origin));
  return 8 * kUnitRoundoff * (m + placed.condition * (o + m) + placed.offset) + 8 * kDenormalStep;
}

/// Added to a pad in t: where t is denormal, each of the plane test's float operations is off by a step of its own.
inline constexpr double kDenormalSlack = 8 * kDenormalStep;

/// The least slope of a ray against planes, as a share of |d|∞ · |n|₁ (see 2. above).
inline constexpr float kLeastSlope = 0x1p-26F;

/// `slope`, or `least` with its sign (that of a zero counts) where it is less steep.
template <typename T>
T at_least(T least, T slope) {
  return std::copysign(std::max(std::abs(slope), least), slope);
}

}  // namespace tessera

#pragma once

#include <cmath>

#include "core/math/ray.h"

namespace tessera {

/// The unit roundoff of double (2^-53). Quadrics are solved in double and t is rounded to float once.
///
/// What culling relies on, for every primitive: when `intersect` returns t, the exact point origin + t · direction
/// lies within 1.1·u·M (max norm, u = 2^-24) of the exact surface, and inside `bounds` grown by as much, where M is
/// the greatest max-norm distance from the ray's origin to a corner of `bounds`. The rounding of t moves the
/// point by at most u·M along the ray; what the double arithmetic adds, less than 2^-30·M in any direction, is said
/// beside each solver. It holds for directions
/// of length 1e-20 to 1e20 and M ≥ 1e-12, where t neither overflows nor becomes denormal.
inline constexpr double kDoubleRoundoff = 0x1p-53;

/// Whether a root, rounded to float, lies in the ray's open interval. A NaN doesn't.
inline bool accepts(const Ray& ray, double root) {
  const auto t = static_cast<float>(root);
  return ray.t_min < t && t < ray.t_max;
}

/// The ray with an interval that holds only `t`, to find the double root behind a t that `intersect` returned:
/// seen from far away the float t alone would place the point well off a small primitive.
inline Ray narrowed_to(Ray ray, float t) {
  ray.t_min = std::nextafter(t, -kInfinity);
  ray.t_max = std::nextafter(t, kInfinity);
  return ray;
}

}  // namespace tessera

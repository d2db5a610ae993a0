#pragma once

#include <algorithm>
#include <cmath>

#include "core/bounds/aabb.h"
#include "core/math/interval.h"
#include "core/math/ray.h"
#include "core/math/transform.h"

namespace tessera {

/// A ray set up to be clipped against many boxes, padded so that a box never loses a hit inside it (law L2).
///
/// What the pad covers. Let M be the largest coordinate distance from the ray's origin to a corner of `reach`, the
/// box of everything that will be tested, and u = 2^-24. Distances are along one axis.
///   1. A plane's t is fl((plane − o) · fl(1/d)): three roundings, 3u·|plane − o| ≤ 3uM.
///   2. A direction component smaller than |d|·2^-26 is replaced by that, so that nothing divides by zero. A point
///      within M of the origin (t ≤ M/|d|∞) moves by at most M·2^-26 = uM/4.
///   3. A primitive's t is exact to one rounding (core/geometry computes in double): u·|t·d| ≤ uM along the axis.
///      What double leaves beside that is below 2^-30·M, uM/64 (core/geometry/double_root.h).
///   4. The pad's own product and difference: 2u of the result, ≤ 2uM(1 + 8u).
/// That is less than 7uM; 8uM is the pad. Instances add the rounding of their transforms (`Transform::Error`).
class CullRay {
 public:
  CullRay(const Ray& ray, const Aabb& reach, Transform::Error placed = {}) : origin_(ray.origin) {
    const double m = std::max(max_component(abs(to_double(reach.lo) - to_double(ray.origin))),
                              max_component(abs(to_double(reach.hi) - to_double(ray.origin))));
    const double o = max_component(abs(ray.origin));
    const double pad = 8 * kUnitRoundoff * (m + placed.condition * (o + m) + placed.offset) + 8 * kDenormalStep;
    const float smallest = max_component(abs(ray.direction)) * 0x1p-26F;
    for (int axis = 0; axis < 3; ++axis) {
      const float d = ray.direction[axis];
      inverse_[axis] = 1 / std::copysign(std::max(std::abs(d), smallest), d);
      pad_[axis] = static_cast<float>(pad * std::abs(inverse_[axis]));
      backward_[axis] = std::signbit(d);
    }
  }

  /// The part of the line within the padded box: contains the t of every hit on what the box bounds. Where coordinates
  /// near the largest float overflow, an end may be NaN; `misses` takes that as no bound at all.
  Interval clip(const Aabb& box) const {
    const auto near = [&](int i) {
      return (((backward_[i] ? box.hi : box.lo)[i] - origin_[i]) * inverse_[i]) - pad_[i];
    };
    const auto far = [&](int i) {
      return (((backward_[i] ? box.lo : box.hi)[i] - origin_[i]) * inverse_[i]) + pad_[i];
    };
    return {std::max(near(0), std::max(near(1), near(2))), std::min(far(0), std::min(far(1), far(2)))};
  }

  /// Whether no hit with t_min < t ≤ limit can lie in a box that was clipped to `span`.
  static bool misses(Interval span, float t_min, float limit) {
    return span.lo > span.hi || span.lo > limit || span.hi < t_min;
  }
  bool misses(const Aabb& box, float t_min, float limit) const { return misses(clip(box), t_min, limit); }

 private:
  Vec3 origin_;
  Vec3 inverse_;
  Vec3 pad_;
  bool backward_[3];
};

}  // namespace tessera

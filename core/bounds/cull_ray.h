#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/bounds/aabb.h"
#include "core/bounds/cull_pad.h"
#include "core/math/interval.h"
#include "core/math/ray.h"
#include "core/math/transform.h"

namespace tessera {

/// Where a ray crosses a plane that parts two closed cells: no hit on the near side lies at t > exit, and none on the
/// far side at t < entry (both padded, law L2). An end that is NaN is no bound.
struct Crossing {
  float entry;
  float exit;
  bool is_descending;  ///< The ray runs against the plane's normal.
};

/// A ray set up to be clipped against many boxes, padded by `cull_pad` so that a box never loses a hit inside it.
class CullRay {
 public:
  CullRay(const Ray& ray, const Aabb& reach, Transform::Error placed = {}) {
    const double pad = cull_pad(ray, reach, placed);
    const float least = max_component(abs(ray.direction)) * kLeastSlope;
    for (int axis = 0; axis < 3; ++axis) {
      const float d = ray.direction[axis];
      origin_[axis] = ray.origin[axis];
      inverse_[axis] = 1 / at_least(least, d);
      pad_[axis] = static_cast<float>(pad * std::abs(inverse_[axis]) + kDenormalSlack);
      backward_[axis] = std::signbit(d) ? -1 : 0;
    }
  }

  /// The part of the line within the padded box: contains the t of every hit on what the box bounds. Where coordinates
  /// near the largest float overflow, an end may be unknown, and is then infinitely far.
  Interval clip(const Aabb& box) const {
    static_assert(sizeof(Aabb) == 6 * sizeof(float));
    Lanes lo, from_z;  // from_z: lo.z, hi.x, hi.y, hi.z
    std::memcpy(&lo, &box.lo.x, sizeof lo);
    std::memcpy(&from_z, &box.lo.z, sizeof from_z);
    const Lanes hi = __builtin_shufflevector(from_z, from_z, 1, 2, 3, 3);
    const Lanes near = ((backward_ ? hi : lo) - origin_) * inverse_ - pad_;
    const Lanes far = ((backward_ ? lo : hi) - origin_) * inverse_ + pad_;
    // A comparison with a NaN is false.
    Interval span;
    for (int axis = 0; axis < 3; ++axis) {
      span.lo = near[axis] > span.lo ? near[axis] : span.lo;
      span.hi = far[axis] < span.hi ? far[axis] : span.hi;
    }
    return span;
  }

  /// Where the ray crosses the plane at `position` on `axis`: see `Crossing`.
  Crossing cross(int axis, float position) const {
    const float t = (position - origin_[axis]) * inverse_[axis];
    return {t - pad_[axis], t + pad_[axis], backward_[axis] != 0};
  }

  /// Whether no hit with t_min < t ≤ limit can lie in a box that was clipped to `span`.
  static bool misses(Interval span, float t_min, float limit) {
    return span.lo > span.hi || span.lo > limit || span.hi < t_min;
  }
  bool misses(const Aabb& box, float t_min, float limit) const { return misses(clip(box), t_min, limit); }

 private:
  /// A value for each axis, and one that isn't used: the compiler's own vectors, which every machine has in some form.
  using Lanes = float __attribute__((vector_size(16)));
  using Masks = std::int32_t __attribute__((vector_size(16)));

  Lanes origin_{}, inverse_{}, pad_{};
  Masks backward_{};  ///< All bits set on the axes along which the ray runs downwards.
};

}  // namespace tessera

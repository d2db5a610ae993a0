#pragma once

#include <algorithm>
#include <cmath>

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
  CullRay(const Ray& ray, const Aabb& reach, Transform::Error placed = {}) : origin_(ray.origin) {
    const double pad = cull_pad(ray, reach, placed);
    const float least = max_component(abs(ray.direction)) * kLeastSlope;
    for (int axis = 0; axis < 3; ++axis) {
      const float d = ray.direction[axis];
      inverse_[axis] = 1 / at_least(least, d);
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

  /// Where the ray crosses the plane at `position` on `axis`: see `Crossing`.
  Crossing cross(int axis, float position) const {
    const float t = (position - origin_[axis]) * inverse_[axis];
    return {t - pad_[axis], t + pad_[axis], backward_[axis]};
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

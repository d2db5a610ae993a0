#pragma once

#include <span>

#include "core/bounds/aabb.h"
#include "core/bounds/cull_pad.h"
#include "core/math/ray.h"

namespace tessera {

/// The box of rays that all lead to one point and end there at most: a light's shadow rays. What lies beside it, all of
/// them miss.
class WayToPoint {
 public:
  /// `reach` and `placed` as for `cull_pad`. Precondition: there are rays, and all are traceable.
  WayToPoint(std::span<const Ray> rays, Vec3 point, const Aabb& reach, Transform::Error placed) {
    Aabb origins;
    for (const Ray& ray : rays) origins.extend(ray.origin);
    // Of an origin in between, some corner of `reach` is no farther than from one of these two, axis by axis.
    pad_ = cull_pad({origins.lo, {}}, reach, placed) + cull_pad({origins.hi, {}}, reach, placed);
    for (const Ray& ray : rays) {
      const Vec3d off = to_double(ray.origin) + to_double(ray.direction) - to_double(point);
      leads_there_ = leads_there_ && ray.t_min >= 0 && ray.t_max <= 1 && max_component(abs(off)) <= pad_ / 8;
    }
    box_ = origins;
    box_.extend(point);
  }

  /// Whether no hit of any of the rays can lie in `other`. A hit lies between its ray's origin and the point but for an
  /// eighth of the pad, by which the ray may lead past that, and what `cull_pad` says of t and of placements.
  bool misses(const Aabb& other) const {
    if (!leads_there_) return false;
    for (int axis = 0; axis < 3; ++axis)
      if (other.lo[axis] > box_.hi[axis] + pad_ || other.hi[axis] < box_.lo[axis] - pad_) return true;
    return false;
  }

 private:
  Aabb box_;
  double pad_;
  bool leads_there_ = true;
};

}  // namespace tessera

#pragma once

#include "core/math/rounding.h"
#include "core/math/vec.h"

namespace tessera {

/// The points `origin + t · direction`. The direction need not have length 1. A primitive is hit only at
/// `t_min < t < t_max`: both ends are open, for every primitive and structure.
struct Ray {
  Vec3 origin;
  Vec3 direction;
  float t_min = 0;
  float t_max = kInfinity;
};

/// Whether the ray can hit anything: finite origin and direction, a direction that isn't zero, an interval that
/// isn't empty. A NaN anywhere makes it false.
inline bool is_traceable(const Ray& ray) {
  return is_finite(ray.origin) && is_finite(ray.direction) && max_component(abs(ray.direction)) > 0 &&
         ray.t_min < ray.t_max;
}

}  // namespace tessera

#pragma once

#include <cstdint>

#include "core/math/rounding.h"
#include "core/math/vec.h"

namespace tessera {

/// A primitive of an object.
struct PrimitiveId {
  std::uint32_t object, primitive;
};

/// No object has it.
inline constexpr PrimitiveId kNoPrimitive{0xFFFFFFFF, 0xFFFFFFFF};

/// The points `origin + t · direction`. The direction need not have length 1. A primitive is hit only at
/// `t_min < t < t_max`: both ends are open, for every primitive and structure.
struct Ray {
  Vec3 origin;
  Vec3 direction;
  float t_min = 0;
  float t_max = kInfinity;
  /// The flat primitive that the ray leaves: it starts strictly beside it, and runs away from it but for a rounding of
  /// its direction. So it can't meet it, and a structure that knows may leave out the test, which from so near has to
  /// be the exact one.
  PrimitiveId leaves = kNoPrimitive;
};

/// Whether the ray can hit anything: finite origin and direction, a direction that isn't zero, an interval that
/// isn't empty. A NaN anywhere makes it false.
inline bool is_traceable(const Ray& ray) {
  return is_finite(ray.origin) && is_finite(ray.direction) && max_component(abs(ray.direction)) > 0 &&
         ray.t_min < ray.t_max;
}

}  // namespace tessera

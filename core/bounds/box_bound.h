#pragma once

#include "core/bounds/bound.h"
#include "core/bounds/cull_ray.h"

namespace tessera {

/// Axis-aligned boxes: least and greatest coordinates.
struct BoxBound {
  using Volume = Aabb;
  using Clipper = CullRay;

  /// Exact for points without slack. Leaves of the outline the box's least and greatest corner.
  Aabb fit(Outline& outline) const;
  Aabb join(const Aabb& a, const Aabb& b) const;
  bool contains(const Aabb& box, Vec3 p) const { return box.contains(p); }
  double cost(const Aabb& box) const { return half_area(box); }
  std::size_t bytes(const Aabb&) const { return 0; }
  CullRay clipper(const Ray& ray, const Aabb& reach, Transform::Error placed = {}) const {
    return {ray, reach, placed};
  }
};
static_assert(Bound<BoxBound>);

}  // namespace tessera

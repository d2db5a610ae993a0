#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "core/bounds/bound.h"
#include "core/bounds/cull_pad.h"
#include "core/bounds/cull_ray.h"

namespace tessera {

/// The half-space n·p ≤ offset; `normal` has length 1 to rounding.
struct HalfSpace {
  Vec3 normal;
  float offset = 0;
};

/// What lies in a box and in all half-spaces; nothing when the box is empty.
struct Polytope {
  Aabb box;
  std::vector<HalfSpace> planes;
  double half_area = 0;  ///< Half the surface area, of the convex hull that the polytope is put around.
};

/// A ray set up for polytopes: it enters through the last plane that faces it and leaves through the first that
/// doesn't.
class HullClipper {
 public:
  HullClipper(const Ray& ray, const Aabb& reach, Transform::Error placed);

  Interval clip(const Polytope& polytope) const {
    if (polytope.box.empty()) return kEmptyInterval;
    const Interval in_box = box_.clip(polytope.box);
    double enter = -kInfinity, leave = kInfinity;
    if (in_box.lo > enter) enter = in_box.lo;  // and a NaN isn't
    if (in_box.hi < leave) leave = in_box.hi;
    for (const HalfSpace& plane : polytope.planes) {
      if (enter > leave) return kEmptyInterval;
      const Vec3d n = to_double(plane.normal);
      const double slope = at_least(least_slope_, dot(n, direction_));
      const double t = (plane.offset - dot(n, origin_) + pad_) / slope;
      if (slope < 0)
        enter = std::max(enter, t);
      else
        leave = std::min(leave, t);
    }
    return {below(enter), above(leave)};
  }

 private:
  CullRay box_;
  Vec3d origin_, direction_;
  double pad_, least_slope_;  ///< Along a unit normal, whose |n|₁ is at most √3.
};

/// Convex hulls, with at most `max_faces` planes beside the box: any choice of half-spaces contains the hull.
struct HullBound {
  using Volume = Polytope;
  using Clipper = HullClipper;

  std::uint32_t max_faces = 24;

  /// Directions come from the faces of the convex hull of points (of ellipsoids, of some points on them), offsets from
  /// the whole outline. Leaves of the outline the hull's corners, and the ellipsoids that reach its surface.
  Polytope fit(Outline& outline) const;

  /// Pushes each one's planes out until they hold the other's box.
  Polytope join(const Polytope& a, const Polytope& b) const;
  bool contains(const Polytope& polytope, Vec3 p) const;
  double cost(const Polytope& polytope) const { return polytope.half_area; }
  std::size_t bytes(const Polytope& polytope) const { return polytope.planes.capacity() * sizeof(HalfSpace); }
  HullClipper clipper(const Ray& ray, const Aabb& reach, Transform::Error placed = {}) const {
    return {ray, reach, placed};
  }
};
static_assert(Bound<HullBound>);

}  // namespace tessera

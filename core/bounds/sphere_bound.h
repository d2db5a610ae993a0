#pragma once

#include <cmath>
#include <numbers>

#include "core/bounds/bound.h"
#include "core/bounds/cull_pad.h"

namespace tessera {

/// A closed ball; empty when `radius` < 0, everything when it is infinite.
struct BoundingSphere {
  Vec3 center;
  float radius = -1;

  constexpr bool operator==(const BoundingSphere&) const = default;
};

/// A ray set up for spheres, solved in double about the foot of the perpendicular from the centre, as in
/// core/geometry/sphere.cpp. The spheres' centres have to lie within `reach`, which those of a fit or a join do.
class SphereClipper {
 public:
  SphereClipper(const Ray& ray, const Aabb& reach, Transform::Error placed)
      : origin_(to_double(ray.origin)),
        direction_(to_double(ray.direction)),
        inverse_dd_(1 / dot(direction_, direction_)),
        pad_(std::numbers::sqrt3 * cull_pad(ray, reach, placed)) {}

  Interval clip(const BoundingSphere& sphere) const {
    if (sphere.radius < 0) return kEmptyInterval;
    const Vec3d f = to_double(sphere.center) - origin_;
    const double closest = dot(f, direction_) * inverse_dd_;
    const Vec3d foot = f - closest * direction_;
    const double radius = sphere.radius + pad_;
    const double rest = radius * radius - dot(foot, foot);
    if (rest < 0) return kEmptyInterval;
    const double half_chord = std::sqrt(rest * inverse_dd_);
    return {below(closest - half_chord), above(closest + half_chord)};
  }

 private:
  Vec3d origin_, direction_;
  double inverse_dd_;
  double pad_;
};

/// Spheres around the outline's points; an ellipsoid counts as the ball around it.
struct SphereBound {
  using Volume = BoundingSphere;
  using Clipper = SphereClipper;

  /// The better one of two: Ritter 1990, "An Efficient Bounding Sphere": around the maximally separated pair along an
  /// axis, grown over the rest; and for not too many points the smallest one there is. Leaves the outline alone.
  BoundingSphere fit(Outline& outline) const;
  BoundingSphere join(const BoundingSphere& a, const BoundingSphere& b) const;
  bool contains(const BoundingSphere& sphere, Vec3 p) const {
    return length(to_double(p) - to_double(sphere.center)) <= sphere.radius;
  }

  /// Half the surface, as `half_area` of a box.
  double cost(const BoundingSphere& sphere) const {
    return sphere.radius < 0 ? 0 : 2 * std::numbers::pi * sphere.radius * sphere.radius;
  }
  std::size_t bytes(const BoundingSphere&) const { return 0; }
  SphereClipper clipper(const Ray& ray, const Aabb& reach, Transform::Error placed = {}) const {
    return {ray, reach, placed};
  }
};
static_assert(Bound<SphereBound>);

}  // namespace tessera

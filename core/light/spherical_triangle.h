#pragma once

#include <optional>

#include "core/math/vec.h"
#include "core/math/vec2.h"

namespace tessera {

/// What a triangle covers of the directions from a point, from which directions are chosen evenly (Arvo, "Stratified
/// Sampling of Spherical Triangles", 1995). All in double.
class SphericalTriangle {
 public:
  /// `a`, `b` and `c` are the ways to its corners. Nothing where they are far away by its size, so that it makes
  /// hardly a difference how it is sampled, or where the point lies all but in its plane, which leaves too few
  /// digits; a NaN gives nothing.
  static std::optional<SphericalTriangle> seen(Vec3d a, Vec3d b, Vec3d c);

  double solid_angle() const { return solid_angle_; }  ///< In [2^-6, 2π].

  /// A direction of length 1, but for roundings, for `u` in [0, 1)²; its density is 1/solid_angle().
  Vec3d sample(Vec2 u) const;

 private:
  SphericalTriangle(Vec3d a, Vec3d b, Vec3d c);

  Vec3d a_, b_, c_;  ///< Of length 1.
  double solid_angle_;
};

}  // namespace tessera

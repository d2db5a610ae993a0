#pragma once

#include <vector>

#include "core/math/rounding.h"
#include "core/math/vec.h"

namespace tessera {

/// The ellipsoid {center + Σ aᵢ·axes[i], |a| ≤ 1}; with `axes[2]` zero an ellipse, which is how a disk looks after any
/// affine map. A ball has three axes of one length, at right angles.
struct Ellipsoid {
  Vec3d center;
  Vec3d axes[3];
};

/// Points and ellipsoids whose convex hull holds something: all that a bounding volume is fitted to. Whatever is held
/// lies within `slack` (on each axis) of that hull.
struct Outline {
  std::vector<Vec3> points;
  std::vector<Ellipsoid> ellipsoids;
  double slack = 0;

  bool empty() const { return points.empty() && ellipsoids.empty(); }
  void append(const Outline& other);
};

/// The least and the greatest n·p over the outline, slack included, rounded outward; lo > hi for an empty outline.
/// Exact but for 2^-48 of |n|₁ · the largest coordinate, by which it is wider.
struct Extent {
  double lo = kInfinity;
  double hi = -kInfinity;
  std::size_t lowest = 0, highest = 0;  ///< Who decides: an index of points, or points.size() + one of ellipsoids.
};
Extent extent_along(Vec3d n, const Outline& outline);

/// The share of `Extent` that is rounding, per unit of |n|₁: whoever drops points for lying less far out than others
/// has to add it to the slack, since along n they may lie farther out by this.
double extent_rounding(const Outline& outline);

/// Leaves only the points and ellipsoids that are marked, counted as in `Extent`.
void keep(Outline& outline, const std::vector<bool>& marked);

/// The radius of a ball about the ellipsoid's centre that contains it: the longest half axis where the axes are at
/// right angles, no less in any case.
double bounding_radius(const Ellipsoid& ellipsoid);

}  // namespace tessera

#pragma once

#include <vector>

#include "core/math/vec.h"

namespace tessera {

/// A ball between roundings; empty when `radius` < 0.
struct Ball {
  Vec3d center;
  double radius = -1;
};

/// The smallest ball that contains both; rounds, by some 2^-51 of what it is about.
Ball join(const Ball& a, const Ball& b);

/// The smallest ball around the points, which it reorders: Welzl 1991, "Smallest enclosing disks (balls and
/// ellipsoids)", with the points that mattered moved to the front. Empty without points. Takes expected linear time,
/// and is what it says but for rounding: points may stick out by some 2^-40 of the radius, more where four of them lie
/// nearly in a circle.
Ball minimal_ball(std::vector<Vec3d>& points);

}  // namespace tessera

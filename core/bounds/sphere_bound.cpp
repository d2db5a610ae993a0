#include "core/bounds/sphere_bound.h"

#include <algorithm>
#include <limits>

#include "core/bounds/minimal_ball.h"

namespace tessera {
namespace {

/// Up to so many points the smallest ball costs no more than a few microseconds.
constexpr std::size_t kMostForMinimalBall = 256;

/// All of the outline as balls, most of them of radius 0.
std::vector<Ball> balls_of(const Outline& outline) {
  std::vector<Ball> balls;
  balls.reserve(outline.points.size() + outline.ellipsoids.size());
  for (const Vec3 p : outline.points) balls.push_back({to_double(p), 0});
  for (const Ellipsoid& e : outline.ellipsoids) balls.push_back({e.center, bounding_radius(e)});
  return balls;
}

Ball widest_pair(const std::vector<Ball>& balls) {
  Ball widest;
  for (int axis = 0; axis < 3; ++axis) {
    const auto first = std::ranges::min_element(balls, {}, [&](const Ball& b) { return b.center[axis] - b.radius; });
    const auto last = std::ranges::max_element(balls, {}, [&](const Ball& b) { return b.center[axis] + b.radius; });
    const Ball pair = join(*first, *last);
    if (pair.radius > widest.radius) widest = pair;
  }
  return widest;
}

Ball ritter(const std::vector<Ball>& balls) {
  Ball ball = widest_pair(balls);
  for (const Ball& each : balls) ball = join(ball, each);
  return ball;
}

/// The rounded centre, with a radius that contains the balls whatever was rounded before. The radius itself rounds by
/// less than 2^-50 before it is rounded outward to float.
BoundingSphere around(Vec3d center, const std::vector<Ball>& balls, double slack) {
  const double most = std::numeric_limits<float>::max();  // an instance may lie beyond
  BoundingSphere sphere{to_float(min(max(center, {-most, -most, -most}), {most, most, most}))};
  double radius = 0;
  for (const Ball& each : balls)
    radius = std::max(radius, length(each.center - to_double(sphere.center)) + each.radius);
  sphere.radius = above(radius * (1 + 0x1p-50) + slack * std::numbers::sqrt3);
  return sphere;
}

}  // namespace

BoundingSphere SphereBound::fit(Outline& outline) const {
  if (outline.empty()) return {};
  const std::vector<Ball> balls = balls_of(outline);
  const BoundingSphere grown = around(ritter(balls).center, balls, outline.slack);
  if (!outline.ellipsoids.empty() || balls.size() > kMostForMinimalBall) return grown;

  std::vector<Vec3d> points;
  for (const Ball& each : balls) points.push_back(each.center);
  const Vec3d center = minimal_ball(points).center;
  const BoundingSphere smallest = around(center, balls, outline.slack);
  return smallest.radius < grown.radius ? smallest : grown;  // a NaN isn't
}

BoundingSphere SphereBound::join(const BoundingSphere& a, const BoundingSphere& b) const {
  const Ball wa{to_double(a.center), a.radius}, wb{to_double(b.center), b.radius};
  if (a.radius < 0) return b;
  if (b.radius < 0) return a;
  return around(tessera::join(wa, wb).center, {wa, wb}, 0);
}

}  // namespace tessera

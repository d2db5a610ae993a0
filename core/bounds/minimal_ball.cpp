#include "core/bounds/minimal_ball.h"

#include <algorithm>
#include <array>
#include <span>

namespace tessera {
namespace {

/// Points that lie on the ball's surface, at most four.
struct Support {
  std::array<Vec3d, 4> points;
  int count = 0;
};

/// The smallest ball with all of the support on its surface. Not finite where the support is dependent.
Ball circumscribed(const Support& support) {
  const auto& p = support.points;
  if (support.count == 0) return {};
  const Vec3d a = p[1] - p[0], b = p[2] - p[0], c = p[3] - p[0];
  Vec3d to_center{};
  if (support.count == 2) {
    to_center = 0.5 * a;
  } else if (support.count == 3) {
    const Vec3d n = cross(a, b);
    to_center = cross(dot(a, a) * b - dot(b, b) * a, n) / (2 * dot(n, n));
  } else if (support.count == 4) {
    const Vec3d bc = cross(b, c);
    to_center = (dot(a, a) * bc + dot(b, b) * cross(c, a) + dot(c, c) * cross(a, b)) / (2 * dot(a, bc));
  }
  return {p[0] + to_center, length(to_center)};
}

/// The smallest ball around the first `count` points that has the support on its surface.
Ball smallest(std::vector<Vec3d>& points, std::size_t count, Support support) {
  Ball ball = circumscribed(support);
  if (support.count == 4) return ball;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3d p = points[i];
    if (length(p - ball.center) <= ball.radius * (1 + 0x1p-40)) continue;
    Support with_p = support;
    with_p.points[with_p.count++] = p;
    const Ball larger = smallest(points, i, with_p);
    if (!is_finite(larger.center)) continue;  // p depends on the support but for rounding
    ball = larger;
    std::rotate(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(i),
                points.begin() + static_cast<std::ptrdiff_t>(i) + 1);
  }
  return ball;
}

}  // namespace

Ball join(const Ball& a, const Ball& b) {
  const double apart = length(b.center - a.center);
  if (b.radius < 0 || apart + b.radius <= a.radius) return a;
  if (a.radius < 0 || apart + a.radius <= b.radius) return b;
  const double radius = 0.5 * (apart + a.radius + b.radius);
  return {a.center + ((radius - a.radius) / apart) * (b.center - a.center), radius};
}

Ball minimal_ball(std::vector<Vec3d>& points) { return smallest(points, points.size(), {}); }

}  // namespace tessera

#include "core/bounds/minimal_ball.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

void expect_ball(std::vector<Vec3d> points, Vec3d center, double radius) {
  const Ball ball = minimal_ball(points);
  EXPECT_NEAR(length(ball.center - center), 0, 1e-12);
  EXPECT_NEAR(ball.radius, radius, 1e-12);
}

TEST(MinimalBall, IsWhatTwoThreeOrFourPointsDecide) {
  std::vector<Vec3d> none;
  EXPECT_LT(minimal_ball(none).radius, 0);
  expect_ball({{1, 2, 3}}, {1, 2, 3}, 0);
  expect_ball({{0, 0, 0}, {4, 0, 0}, {1, 1, 0}, {4, 0, 0}}, {2, 0, 0}, 2);
  const double h = std::sqrt(3.0);
  expect_ball({{0, 0, 5}, {2, 0, 5}, {1, h, 5}, {1, 0.1, 5}}, {1, h / 3, 5}, 2 / h);
  expect_ball({{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}, {0.5, 0, 0}}, {0, 0, 0}, h);
}

TEST(MinimalBall, OfACubeIsAroundItsCorners) {
  std::vector<Vec3d> corners;
  for (int i = 0; i < 8; ++i) corners.push_back({i & 1 ? 1.0 : 0, i & 2 ? 1.0 : 0, i & 4 ? 1.0 : 0});
  expect_ball(corners, {0.5, 0.5, 0.5}, std::sqrt(0.75));
}

TEST(MinimalBall, HoldsItsPointsAndIsNoLargerThanAnyOther) {
  for (int seed = 0; seed < 5000; ++seed) {
    Random random(seed);
    std::vector<Vec3d> points;
    const Vec3d a = random.in_cube(), b = random.in_cube();
    const auto kind = random.bits() % 3;
    for (std::size_t i = 0, n = 1 + random.bits() % 60; i < n; ++i) {
      const Vec3d p = random.in_cube();
      points.push_back(kind == 0 ? p : kind == 1 ? p.x * a + p.y * b : random.direction());
    }
    const Ball ball = minimal_ball(points);
    for (const Vec3d p : points) ASSERT_LE(length(p - ball.center), ball.radius * (1 + 1e-9)) << "seed " << seed;
    // A smaller ball would have its centre somewhere: no step away brings the farthest point nearer.
    for (int step = 0; step < 20; ++step) {
      const Vec3d center = ball.center + random.magnitude(-4, 0) * random.direction();
      double radius = 0;
      for (const Vec3d p : points) radius = std::max(radius, length(p - center));
      ASSERT_GE(radius, ball.radius * (1 - 1e-9)) << "seed " << seed;
    }
  }
}

TEST(Ball, JoinIsTheSmallestAroundBoth) {
  const Ball both = join({{0, 0, 0}, 1}, {{4, 0, 0}, 2});
  EXPECT_NEAR(both.radius, 3.5, 1e-15);
  EXPECT_NEAR(both.center.x, 2.5, 1e-15);
  EXPECT_EQ(join({{0, 0, 0}, 5}, {{1, 0, 0}, 2}).radius, 5);
  EXPECT_EQ(join({{1, 0, 0}, 2}, {{0, 0, 0}, 5}).radius, 5);
  EXPECT_EQ(join({}, {{1, 0, 0}, 2}).radius, 2);
}

}  // namespace
}  // namespace tessera

#include "core/bounds/sphere_bound.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

BoundingSphere sphere_around(Outline outline) { return SphereBound().fit(outline); }

TEST(SphereBound, IsSmallestAroundFewPoints) {
  const BoundingSphere sphere = sphere_around({{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}, {}, 0});
  EXPECT_NEAR(sphere.radius, std::sqrt(3.0), 1e-6);
  EXPECT_NEAR(length(to_double(sphere.center)), 0, 1e-6);
}

TEST(SphereBound, GrownAroundManyIsLooserByAFewPercent) {
  Outline many;
  Random random(1);
  for (int i = 0; i < 5000; ++i) many.points.push_back(to_float(random.direction()));
  EXPECT_GE(sphere_around(many).radius, 1);
  EXPECT_LE(sphere_around(many).radius, 1.1F);
}

TEST(SphereBound, TakesAnEllipsoidAsTheBallAroundIt) {
  const BoundingSphere ball = sphere_around({{}, {{{1, 2, 3}, {{2, 0, 0}, {0, 2, 0}, {0, 0, 2}}}}, 0});
  EXPECT_EQ(ball.center, (Vec3{1, 2, 3}));
  EXPECT_NEAR(ball.radius, 2, 1e-6);
  const BoundingSphere capsule =
      sphere_around({{}, {{{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {}}}, {{0, 0, 4}, {{0.5, 0, 0}, {0, 0.5, 0}, {}}}}, 0});
  EXPECT_NEAR(capsule.radius, 2.75, 1e-6);
  EXPECT_NEAR(capsule.center.z, 1.75, 1e-6);
}

TEST(SphereBound, SlackIsOnEveryAxis) {
  EXPECT_NEAR(sphere_around({{{1, 0, 0}}, {}, 2}).radius, 2 * std::sqrt(3.0), 1e-5);
}

TEST(SphereBound, ClipsToTheChord) {
  const BoundingSphere sphere{{0, 0, 10}, 2};
  const Aabb reach{{-2, -2, 8}, {2, 2, 12}};
  const Interval middle = SphereBound().clipper({{0, 0, 0}, {0, 0, 2}}, reach).clip(sphere);
  EXPECT_NEAR(middle.lo, 4, 1e-4);
  EXPECT_NEAR(middle.hi, 6, 1e-4);
  const Interval behind = SphereBound().clipper({{0, 0, 0}, {0, 0, -1}}, reach).clip(sphere);
  EXPECT_NEAR(behind.hi, -8, 1e-4);
  const Interval beside = SphereBound().clipper({{2.001F, 0, 0}, {0, 0, 1}}, reach).clip(sphere);
  EXPECT_GT(beside.lo, beside.hi);
}

TEST(SphereBound, CostIsHalfTheSurface) {
  EXPECT_NEAR(SphereBound().cost({{}, 1}), 2 * std::numbers::pi, 1e-12);
  EXPECT_EQ(SphereBound().cost({}), 0);
}

TEST(SphereBound, BeyondTheLargestFloatIsEverything) {
  const BoundingSphere all = sphere_around({{{3e38F, 3e38F, 3e38F}, {-3e38F, -3e38F, -3e38F}}, {}, 0});
  EXPECT_EQ(all.radius, kInfinity);
  const Aabb reach{{-3e38F, -3e38F, -3e38F}, {3e38F, 3e38F, 3e38F}};
  const Interval span = SphereBound().clipper({{0, 0, 0}, {1, 0, 0}}, reach).clip(all);
  EXPECT_LE(span.lo, -3e38F);
  EXPECT_GE(span.hi, 3e38F);
}

}  // namespace
}  // namespace tessera

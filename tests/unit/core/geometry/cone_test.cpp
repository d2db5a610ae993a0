#include "core/geometry/cone.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/geometry/cylinder.h"
#include "tests/support/random.h"
#include "tests/unit/core/geometry/expect_close.h"

namespace tessera {
namespace {

/// Radius 1 at z = 0, tip at z = 1: the slant has 45°.
constexpr Cone kTipped{{0, 0, 0}, 1, {0, 0, 1}, 0};
constexpr Cone kTruncated{{0, 0, 0}, 2, {0, 0, 4}, 1};
const float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(Cone, NearAndFarWall) {
  EXPECT_EQ(intersect(kTipped, {{-5, 0, 0.5F}, {1, 0, 0}}), 4.5F);
  EXPECT_EQ(intersect(kTipped, {{-5, 0, 0.5F}, {1, 0, 0}, 4.5F}), 5.5F);
  EXPECT_EQ(intersect(kTipped, {{0, 0, 0.5F}, {1, 0, 0}}), 0.5F);
  EXPECT_EQ(intersect(kTruncated, {{-5, 0, 2}, {1, 0, 0}}), 3.5F);
  EXPECT_EQ(intersect(kTruncated, {{-5, 0, 2}, {2, 0, 0}}), 1.75F);
}

TEST(Cone, NoCaps) {
  EXPECT_EQ(intersect(kTipped, {{0.5F, 0, -3}, {0, 0, 1}}), 3.5F);             // through the open base onto the wall
  EXPECT_EQ(intersect(kTruncated, {{0.5F, 0, -3}, {0, 0, 1}}), std::nullopt);  // in and out again
  EXPECT_EQ(intersect(kTruncated, {{1.5F, 0, 9}, {0, 0, -1}}), 7.0F);
}

TEST(Cone, EndsAreClosed) {
  EXPECT_EQ(intersect(kTruncated, {{-5, 0, 0}, {1, 0, 0}}), 3.0F);
  EXPECT_EQ(intersect(kTruncated, {{-5, 0, 4}, {1, 0, 0}}), 4.0F);
  EXPECT_EQ(intersect(kTruncated, {{-5, 0, -1e-6F}, {1, 0, 0}}), std::nullopt);
  EXPECT_EQ(intersect(kTruncated, {{-5, 0, 4.000001F}, {1, 0, 0}}), std::nullopt);
}

TEST(Cone, MirrorNappeIsNotThere) {
  EXPECT_EQ(intersect(kTipped, {{-5, 0, 1.5F}, {1, 0, 0}}), std::nullopt);
  // Comes in through the mirror nappe, which would be the near root, and hits the real one.
  EXPECT_FLOAT_EQ(*intersect(kTipped, {{0.25F, 0, 9}, {0, 0, -1}}), 8.25F);
}

TEST(Cone, RayParallelToTheSlant) {
  // Along x = −z + 3 in the plane y = 0: parallel to the slant on the right, never meets the cone.
  EXPECT_EQ(intersect(kTipped, {{3, 0, 0}, {-1, 0, 1}}), std::nullopt);
  // Along x = −z, parallel to the right slant, from below through the open base: meets the left one at (−0.5, 0.5).
  EXPECT_FLOAT_EQ(*intersect(kTipped, {{0.5F, 0, -0.5F}, {-1, 0, 1}}), 1.0F);
}

TEST(Cone, AlongTheAxisOntoTheTip) {
  const Ray ray{{0, 0, 5}, {0, 0, -1}};
  const auto t = intersect(kTipped, ray);
  ASSERT_TRUE(t);
  EXPECT_EQ(*t, 4.0F);
  expect_close(surface(kTipped, ray, *t).geometric_normal, {0, 0, 1});
}

TEST(Cone, Stress07And09_UntraceableRaysMiss) {
  for (const Cone& cone : {kTipped, kTruncated, Cone{{0, 0, 0}, 1, {0, 0, 1}, 1}}) {
    for (const float bad : {kNan, kInfinity, -kInfinity})
      for (int axis = 0; axis < 3; ++axis) {
        Ray ray{{-5, 0, 0.5F}, {1, 0, 0}};
        ray.origin[axis] = bad;
        EXPECT_EQ(intersect(cone, ray), std::nullopt) << bad << " in origin, axis " << axis;
        ray = {{-5, 0, 0.5F}, {1, 0, 0}};
        ray.direction[axis] = bad;
        EXPECT_EQ(intersect(cone, ray), std::nullopt) << bad << " in direction, axis " << axis;
      }
    EXPECT_EQ(intersect(cone, {{-5, 0, 0.5F}, {1, 0, 0}, kNan}), std::nullopt);
    EXPECT_EQ(intersect(cone, {{-5, 0, 0.5F}, {0, 0, 0}}), std::nullopt);
    EXPECT_EQ(intersect(cone, {{0, 0, 0.5F}, {0, 0, 0}}), std::nullopt);
  }
}

TEST(Cone, NormalLooksAwayFromTheAxis) {
  const double s = std::sqrt(0.5);
  const Ray ray{{-5, 0, 0.5F}, {1, 0, 0}};
  expect_close(surface(kTipped, ray, 4.5F).geometric_normal, {-s, 0, s});
  expect_close(surface(kTipped, ray, 5.5F).geometric_normal, {s, 0, s});
  expect_close(surface(kTipped, ray, 4.5F).position, {-0.5, 0, 0.5});
  // The same cone named from its tip.
  expect_close(surface(Cone{{0, 0, 1}, 0, {0, 0, 0}, 1}, ray, 4.5F).geometric_normal, {-s, 0, s});
  // Seen from inside it still looks away from the axis.
  expect_close(surface(kTipped, {{0, 0, 0.5F}, {0, 1, 0}}, 0.5F).geometric_normal, {0, s, s});
}

TEST(Cone, EqualRadiiAreACylinder) {
  for (int seed = 0; seed < 1000; ++seed) {
    Random random(seed);
    const Vec3 base = to_float(random.in_cube()), apex = to_float(random.in_cube());
    const auto radius = static_cast<float>(random.uniform(0.1, 1));
    const Ray ray{to_float(5.0 * random.direction()), to_float(random.direction())};
    EXPECT_EQ(intersect(Cone{base, radius, apex, radius}, ray), intersect(Cylinder{base, apex, radius}, ray)) << seed;
  }
}

TEST(Cone, Bounds) {
  const Aabb box = bounds(kTruncated);
  EXPECT_TRUE(box.contains(Aabb{{-2, -2, 0}, {2, 2, 4}}));
  EXPECT_LT(max_component(box.diagonal()), 4.000001F);
  // Tilted by 45° about y, the base circle reaches sin 45° along the axis.
  const float s = std::sqrt(0.5F);
  const Aabb tilted = bounds(Cone{{0, 0, 0}, 1, {3, 0, 3}, 0});
  EXPECT_NEAR(tilted.lo.x, -s, 1e-6);
  EXPECT_NEAR(tilted.lo.y, -1, 1e-6);
  EXPECT_NEAR(tilted.lo.z, -s, 1e-6);
  EXPECT_NEAR(tilted.hi.x, 3, 1e-6);
}

}  // namespace
}  // namespace tessera

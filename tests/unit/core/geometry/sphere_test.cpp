#include "core/geometry/sphere.h"

#include <gtest/gtest.h>

#include "tests/unit/core/geometry/expect_close.h"

namespace tessera {
namespace {

constexpr Sphere kUnit{{0, 0, 0}, 1};
const float kQuietNan = std::numeric_limits<float>::quiet_NaN();

TEST(Sphere, NearRootFirst) {
  EXPECT_EQ(intersect(kUnit, {{0, 0, 3}, {0, 0, -1}}), 2.0F);
  EXPECT_EQ(intersect(kUnit, {{0, 0, 3}, {0, 0, -2}}), 1.0F);
  EXPECT_EQ(intersect({{1, 2, 3}, 0.5F}, {{1, 2, 0}, {0, 0, 1}}), 2.5F);
  // Chord at height 0.6: half of it is 0.8.
  EXPECT_FLOAT_EQ(*intersect(kUnit, {{-3, 0.6F, 0}, {1, 0, 0}}), 2.2F);
}

TEST(Sphere, FarRootWhenTheNearOneIsNotInTheInterval) {
  EXPECT_EQ(intersect(kUnit, {{0, 0, 3}, {0, 0, -1}, 2.5F}), 4.0F);
  EXPECT_EQ(intersect(kUnit, {{0, 0, 3}, {0, 0, -1}, 2.5F, 3.5F}), std::nullopt);
}

TEST(Sphere, MissesBesideAndBehind) {
  EXPECT_EQ(intersect(kUnit, {{0, 1.001F, 3}, {0, 0, -1}}), std::nullopt);
  EXPECT_EQ(intersect(kUnit, {{0, 0, 3}, {0, 0, 1}}), std::nullopt);
}

TEST(Sphere, Stress31_OriginInsideOrOnTheSphere) {
  EXPECT_EQ(intersect(kUnit, {{0, 0, 0}, {0, 1, 0}}), 1.0F);
  EXPECT_EQ(intersect(kUnit, {{0.5F, 0, 0}, {1, 0, 0}}), 0.5F);
  EXPECT_EQ(intersect(kUnit, {{1, 0, 0}, {-1, 0, 0}}), 2.0F);
  EXPECT_EQ(intersect(kUnit, {{1, 0, 0}, {1, 0, 0}}), std::nullopt);
  EXPECT_EQ(intersect(kUnit, {{1, 0, 0}, {0, 1, 0}}), std::nullopt);  // touches at t = 0 only
}

/// One ulp beside the tangent the ray hits or misses as it must; on it, it touches.
TEST(Sphere, Stress31_TangentRays) {
  const auto at_height = [](float y) { return intersect(kUnit, {{-2, y, 0}, {1, 0, 0}}); };
  EXPECT_EQ(at_height(1), 2.0F);
  float above = 1, below = 1;
  for (int k = 1; k <= 8; ++k) {
    above = std::nextafter(above, 2.0F);
    below = std::nextafter(below, 0.0F);
    EXPECT_EQ(at_height(above), std::nullopt) << k << " ulp";
    ASSERT_TRUE(at_height(below)) << k << " ulp";
    EXPECT_FLOAT_EQ(*at_height(below), static_cast<float>(2 - std::sqrt(1 - static_cast<double>(below) * below)));
  }
}

TEST(Sphere, Stress08_BothEndsOfTheIntervalAreOpen) {
  const Vec3 origin{0, 0, 3}, down{0, 0, -1};
  EXPECT_EQ(intersect(kUnit, {origin, down, 0, 2}), std::nullopt);
  EXPECT_EQ(intersect(kUnit, {origin, down, 0, std::nextafter(2.0F, 3.0F)}), 2.0F);
  EXPECT_EQ(intersect(kUnit, {origin, down, 2, 9}), 4.0F);
  EXPECT_EQ(intersect(kUnit, {origin, down, 4, 9}), std::nullopt);
  EXPECT_EQ(intersect(kUnit, {origin, down, 9, 0}), std::nullopt);
}

TEST(Sphere, Stress07And09_UntraceableRaysMiss) {
  for (const float bad : {kQuietNan, kInfinity, -kInfinity})
    for (int axis = 0; axis < 3; ++axis) {
      Ray ray{{0, 0, 3}, {0, 0, -1}};
      ray.origin[axis] = bad;
      EXPECT_EQ(intersect(kUnit, ray), std::nullopt) << bad << " in origin, axis " << axis;
      ray = {{0, 0, 3}, {0, 0, -1}};
      ray.direction[axis] = bad;
      EXPECT_EQ(intersect(kUnit, ray), std::nullopt) << bad << " in direction, axis " << axis;
    }
  EXPECT_EQ(intersect(kUnit, {{0, 0, 3}, {0, 0, -1}, kQuietNan}), std::nullopt);
  EXPECT_EQ(intersect(kUnit, {{0, 0, 3}, {0, 0, -1}, 0, kQuietNan}), std::nullopt);
  EXPECT_EQ(intersect(kUnit, {{0, 0, 3}, {0, 0, 0}}), std::nullopt);
  EXPECT_EQ(intersect(kUnit, {{0, 0, 0}, {0, 0, 0}}), std::nullopt);
}

TEST(Sphere, Stress30_TinyBesideHuge) {
  const Sphere huge{{0, -1e6F, 0}, 1e6F}, tiny{{0, 2e-6F, 0}, 1e-6F};
  const Ray down{{0, 1, 0}, {0, -1, 0}};
  EXPECT_FLOAT_EQ(*intersect(huge, down), 1);
  EXPECT_NEAR(*intersect(tiny, down), 1 - 3e-6, 6e-8);
  EXPECT_TRUE(intersect(tiny, {{1000, 2e-6F, 0}, {-1, 0, 0}}));
}

/// The normal comes from the double root: t alone is only good to half a metre at that range.
TEST(Sphere, Stress28_NormalFromTenMillionMetresAway) {
  const Ray ray{{0, 0.6F, 1e7F}, {0, 0, -1}};
  const auto t = intersect(kUnit, ray);
  ASSERT_TRUE(t);
  EXPECT_EQ(*t, 9999999.0F);
  expect_close(surface(kUnit, ray, *t).geometric_normal, {0, 0.6, 0.8}, 1e-7);
}

TEST(Sphere, SurfaceOfBothRoots) {
  const Ray ray{{5, 2, 3}, {-1, 0, 0}};
  const Sphere sphere{{1, 2, 3}, 2};
  const SurfacePoint near = surface(sphere, ray, 2), far = surface(sphere, ray, 6);
  expect_close(near.position, {3, 2, 3});
  expect_close(near.geometric_normal, {1, 0, 0});
  expect_close(far.position, {-1, 2, 3});
  expect_close(far.geometric_normal, {-1, 0, 0});
  expect_close(far.shading_normal, {-1, 0, 0});
}

TEST(Sphere, Bounds) {
  const Aabb box = bounds(Sphere{{1, 2, 3}, 0.5F});
  EXPECT_TRUE(box.contains(Aabb{{0.5F, 1.5F, 2.5F}, {1.5F, 2.5F, 3.5F}}));
  EXPECT_LT(max_component(box.diagonal()), 1.000001F);
}

}  // namespace
}  // namespace tessera

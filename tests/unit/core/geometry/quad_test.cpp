#include "core/geometry/quad.h"

#include <gtest/gtest.h>

#include "tests/unit/core/geometry/expect_close.h"

namespace tessera {
namespace {

constexpr Quad kSquare{{{{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}}};

TEST(Quad, BothTrianglesAreHitFromBothSides) {
  EXPECT_EQ(intersect(kSquare, {{1.5F, 0.5F, 3}, {0, 0, -1}}), 3.0F);
  EXPECT_EQ(intersect(kSquare, {{0.5F, 1.5F, 3}, {0, 0, -1}}), 3.0F);
  EXPECT_EQ(intersect(kSquare, {{0.5F, 1.5F, -4}, {0, 0, 2}}), 2.0F);
  EXPECT_EQ(intersect(kSquare, {{2.5F, 1, 3}, {0, 0, -1}}), std::nullopt);
}

TEST(Quad, DiagonalEdgesAndCornersAreInside) {
  for (const Vec3 p : {Vec3{1, 1, 3}, {0, 0, 3}, {2, 0, 3}, {2, 2, 3}, {0, 2, 3}, {1, 0, 3}, {0, 1, 3}})
    EXPECT_EQ(intersect(kSquare, {p, {0, 0, -1}}), 3.0F) << p.x << ' ' << p.y;
}

TEST(Quad, Stress34_ParallelRaysMiss) {
  EXPECT_EQ(intersect(kSquare, {{-1, 1, 0}, {1, 0, 0}}), std::nullopt);
  EXPECT_EQ(intersect(kSquare, {{-1, 1, 0.5F}, {1, 0, 0}}), std::nullopt);
}

TEST(Quad, Stress34_NearlyParallelRaysAtALargeQuadHit) {
  constexpr float kFar = 1e8F;
  constexpr Quad kGround{{{{-kFar, 0, kFar}, {kFar, 0, kFar}, {kFar, 0, -kFar}, {-kFar, 0, -kFar}}}};
  for (const float slope : {1e-3F, 1e-5F, 1e-7F}) {
    const auto t = intersect(kGround, {{0, 1, 0}, {1, -slope, 0.25F}});
    ASSERT_TRUE(t) << slope;
    EXPECT_FLOAT_EQ(*t, 1 / slope);
  }
}

TEST(Quad, FrontIsCounterClockwise) {
  const SurfacePoint first = surface(kSquare, {{1.5F, 0.5F, -4}, {0, 0, 1}}, 4);
  expect_close(first.position, {1.5, 0.5, 0});
  expect_close(first.geometric_normal, {0, 0, 1});
  const SurfacePoint second = surface(kSquare, {{0.5F, 1.5F, 3}, {0, 0, -1}}, 3);
  expect_close(second.position, {0.5, 1.5, 0});
  expect_close(second.shading_normal, {0, 0, 1});
}

/// Folded along its diagonal it may be crossed twice: the nearer half counts, with its own normal.
TEST(Quad, FoldedQuadGivesTheNearerHalf) {
  constexpr Quad kFolded{{{{0, 0, 0}, {4, 0, 0}, {0, 0, 4}, {4, 1, 0}}}};
  const Ray down{{2, 5, 1}, {0, -1, 0}};
  const auto t = intersect(kFolded, down);
  ASSERT_TRUE(t);
  EXPECT_LT(*t, 5.0F);
  EXPECT_NEAR(surface(kFolded, down, *t).position.y, 5.0 - *t, 1e-6);
}

TEST(Quad, Bounds) { EXPECT_EQ(bounds(kSquare), (Aabb{{0, 0, 0}, {2, 2, 0}})); }

}  // namespace
}  // namespace tessera

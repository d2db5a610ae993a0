#include <gtest/gtest.h>

#include "core/bounds/outline.h"
#include "core/scene/scene.h"

namespace tessera {
namespace {

Object placed_by(const std::array<double, 12>& rows) { return {0, 0, Transform::from_rows(rows).value()}; }

const Ellipsoid kBall{{1, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

TEST(WorldOutline, WithoutAPlacementIsTheOutline) {
  const Outline same = world_outline({}, {{{1, 2, 3}}, {kBall}, 0.25});
  EXPECT_EQ(same.points, (std::vector<Vec3>{{1, 2, 3}}));
  EXPECT_EQ(same.ellipsoids.size(), 1);
  EXPECT_EQ(same.slack, 0.25);
}

TEST(WorldOutline, CarriesPointsAndEllipsoids) {
  // Stretched to (2, 4, 1), then moved by (10, 0, 0).
  const Object object = placed_by({2, 0, 0, 10, 0, 4, 0, 0, 0, 0, 1, 0});
  const Outline world = world_outline(object, {{{1, 2, 3}}, {kBall}, 0.25});
  EXPECT_EQ(world.points, (std::vector<Vec3>{{12, 8, 3}}));
  const Extent x = extent_along({1, 0, 0}, {{}, world.ellipsoids, 0});
  EXPECT_NEAR(x.lo, 10, 1e-9);
  EXPECT_NEAR(x.hi, 14, 1e-9);
  EXPECT_NEAR(extent_along({0, 1, 0}, {{}, world.ellipsoids, 0}).hi, 4, 1e-9);
  EXPECT_NEAR(world.slack, 1, 1e-5) << "0.25, stretched by 4";
}

/// Far away floats are coarse: a million metres along x and back along y leave nothing of it along x + y.
TEST(WorldOutline, AllowsForTheRoundingOfPoints) {
  const Object object = placed_by({1, 0, 0, 1e6, 0, 1, 0, -1e6, 0, 0, 1, 0});
  for (int i = 0; i < 100; ++i) {
    const float x = 0.013F * static_cast<float>(i), y = 0.007F * static_cast<float>(i);
    const Extent sum = extent_along({1, 1, 0}, world_outline(object, {{{x, y, 0}}, {}, 0}));
    EXPECT_LE(sum.lo, double{x} + y) << i;
    EXPECT_GE(sum.hi, double{x} + y) << i;
    EXPECT_LE(sum.hi - sum.lo, 1) << i;
  }
}

TEST(WorldOutline, KeepsWhatLiesBeyondTheLargestFloat) {
  const Object object = placed_by({1e10, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
  const Outline world = world_outline(object, {{{1e30F, 2, 3}, {1, 2, 3}}, {}, 0});
  EXPECT_EQ(world.points.size(), 1);
  const Extent x = extent_along({1, 0, 0}, world);
  EXPECT_GE(x.hi, 1e40);
  EXPECT_TRUE(std::isfinite(extent_along({0, 1, 0}, world).hi));
}

}  // namespace
}  // namespace tessera

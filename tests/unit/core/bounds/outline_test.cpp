#include "core/bounds/outline.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

const Ellipsoid kRoundBall{{10, 0, 0}, {{2, 0, 0}, {0, 2, 0}, {0, 0, 2}}};
const Ellipsoid kEllipse{{0, 0, 1}, {{3, 0, 0}, {0, 1, 0}, {}}};

TEST(Outline, ExtentIsOverPointsAndEllipsoids) {
  const Outline outline{{{1, 2, 3}, {-4, 0, 0}}, {kRoundBall, kEllipse}, 0};
  const Extent x = extent_along({1, 0, 0}, outline);
  EXPECT_NEAR(x.lo, -4, 1e-12);
  EXPECT_NEAR(x.hi, 12, 1e-12);
  EXPECT_EQ(x.lowest, 1);
  EXPECT_EQ(x.highest, 2);
  const Extent diagonal = extent_along({1, 1, 0}, outline);
  EXPECT_NEAR(diagonal.hi, 10 + std::sqrt(8.0), 1e-12);
  EXPECT_NEAR(diagonal.lo, -4, 1e-12);
  EXPECT_NEAR(extent_along({3, 4, 0}, {{}, {kEllipse}, 0}).hi, std::sqrt(81.0 + 16), 1e-12);
}

TEST(Outline, ExtentIsRoundedOutward) {
  const Extent x = extent_along({1, 0, 0}, {{{1, 2, 3}}, {}, 0});
  EXPECT_LT(x.lo, 1);
  EXPECT_GT(x.hi, 1);
}

TEST(Outline, SlackCountsOnEveryAxis) {
  const Extent diagonal = extent_along({1, -2, 0}, {{{1, 0, 0}}, {}, 0.5});
  EXPECT_NEAR(diagonal.hi, 1 + 1.5, 1e-12);
  EXPECT_NEAR(diagonal.lo, 1 - 1.5, 1e-12);
}

TEST(Outline, OfNothingHasNoExtent) {
  const Extent none = extent_along({1, 0, 0}, {});
  EXPECT_GT(none.lo, none.hi);
}

TEST(Outline, AppendKeepsTheLargerSlack) {
  Outline a{{{1, 0, 0}}, {}, 0.5};
  a.append({{{2, 0, 0}}, {kRoundBall}, 0.25});
  EXPECT_EQ(a.points.size(), 2);
  EXPECT_EQ(a.ellipsoids.size(), 1);
  EXPECT_EQ(a.slack, 0.5);
}

TEST(Outline, KeepLeavesWhatIsMarked) {
  Outline outline{{{1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, {kRoundBall, kEllipse}, 0};
  keep(outline, {false, true, false, false, true});
  ASSERT_EQ(outline.points.size(), 1);
  EXPECT_EQ(outline.points[0].x, 2);
  ASSERT_EQ(outline.ellipsoids.size(), 1);
  EXPECT_EQ(outline.ellipsoids[0].center.z, 1);
}

TEST(Ellipsoid, BoundingRadiusIsItsLongestHalfAxis) {
  EXPECT_NEAR(bounding_radius(kRoundBall), 2, 1e-12);
  EXPECT_NEAR(bounding_radius(kEllipse), 3, 1e-12);
  // The same axis thrice: a segment of half length √3.
  EXPECT_NEAR(bounding_radius({{}, {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}}}), std::sqrt(3.0), 1e-12);
}

}  // namespace
}  // namespace tessera

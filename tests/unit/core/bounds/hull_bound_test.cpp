#include "core/bounds/hull_bound.h"

#include <gtest/gtest.h>

#include "core/bounds/facets.h"
#include "tests/support/meshes.h"
#include "tests/support/random.h"

namespace tessera {
namespace {

Polytope fit(Outline outline, std::uint32_t max_faces = 24) { return HullBound{max_faces}.fit(outline); }

const Ellipsoid kBall{{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

TEST(HullBound, OfATetrahedronIsItsFaces) {
  const Polytope polytope = fit({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {}, 0});
  EXPECT_NEAR(polytope.half_area, (1.5 + std::sqrt(3.0) / 2) / 2, 1e-6);
  EXPECT_TRUE(HullBound().contains(polytope, {0.3F, 0.3F, 0.3F}));
  EXPECT_FALSE(HullBound().contains(polytope, {0.34F, 0.34F, 0.34F}));
}

TEST(HullBound, HasNoMorePlanesThanAsked) {
  const Outline sphere{icosphere(4).positions, {}, 0};
  for (const std::uint32_t faces : {4U, 24U, 200U}) EXPECT_EQ(fit(sphere, faces).planes.size(), faces);
}

TEST(HullBound, GetsTighterWithMorePlanes) {
  const Outline sphere{icosphere(4).positions, {}, 0};
  std::vector<int> inside;
  for (const std::uint32_t faces : {4U, 24U, 200U}) {
    const Polytope polytope = fit(sphere, faces);
    Random random(7);
    int count = 0;
    for (int i = 0; i < 20'000; ++i) count += HullBound().contains(polytope, to_float(random.in_cube()));
    inside.push_back(count);
  }
  // The ball is 52.4% of its cube.
  EXPECT_GT(inside[0], inside[1]);
  EXPECT_LT(inside[1], 20'000 * 0.62);
  EXPECT_LT(inside[2], 20'000 * 0.54);
  EXPECT_GE(inside[2], 20'000 * 0.51);
}

TEST(HullBound, ClosesWhatIsFlat) {
  // A square that stands on a corner: its box is much larger.
  const Polytope polytope = fit({{{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}}, {}, 0});
  EXPECT_FALSE(HullBound().contains(polytope, {0.9F, 0.9F, 0}));
  EXPECT_FALSE(HullBound().contains(polytope, {0, 0, 1e-3F}));
  EXPECT_TRUE(HullBound().contains(polytope, {0.4F, 0.4F, 0}));
  EXPECT_NEAR(polytope.half_area, 2, 1e-6);
}

TEST(HullBound, ClosesALine) {
  const Polytope polytope = fit({{{0, 0, 0}, {1, 2, 3}}, {}, 0});
  EXPECT_TRUE(HullBound().contains(polytope, {0.5F, 1, 1.5F}));
  for (const Vec3 beside : {Vec3{0.5F, 1, 1.4F}, Vec3{0.4F, 1, 1.5F}, Vec3{0.5F, 1.1F, 1.5F}})
    EXPECT_FALSE(HullBound().contains(polytope, beside));
}

TEST(HullBound, IsSnugAroundEllipsoids) {
  const Polytope polytope = fit({{}, {kBall}, 0});
  EXPECT_FALSE(HullBound().contains(polytope, {0.8F, 0.8F, 0.8F}));
  EXPECT_GT(polytope.half_area, 0.8 * 2 * std::numbers::pi);
  // A disk, tilted: flat but for rounding, closed all around.
  const double s = std::sqrt(0.5);
  const Polytope disk = fit({{}, {{{5, 5, 5}, {{s, s, 0}, {0, 0, 1}, {}}}}, 0});
  EXPECT_TRUE(HullBound().contains(disk, {5.7F, 5.7F, 5}));
  EXPECT_FALSE(HullBound().contains(disk, {5.65F, 5.65F, 5.9F}));
  EXPECT_FALSE(HullBound().contains(disk, {5.1F, 5, 5}));
}

TEST(HullBound, ThinsToCornersAndWhatReachesTheSurface) {
  Outline outline{{}, {}, 0};
  for (int i = 0; i < 8; ++i) outline.points.push_back({i & 1 ? 9.0F : -9, i & 2 ? 9.0F : -9, i & 4 ? 9.0F : -9});
  for (int i = 0; i < 50; ++i) outline.points.push_back({static_cast<float>(i) * 0.1F, 3, 2});
  outline.ellipsoids = {kBall, {{8.5, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}};
  HullBound().fit(outline);
  EXPECT_EQ(outline.points.size(), 8);
  ASSERT_EQ(outline.ellipsoids.size(), 1);
  EXPECT_EQ(outline.ellipsoids[0].center.x, 8.5);
}

TEST(HullBound, ClipsAgainstItsFaces) {
  const Polytope polytope = fit({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {}, 0});
  const HullClipper along({{0.25F, 0.25F, -1}, {0, 0, 1}}, polytope.box, {});
  const Interval span = along.clip(polytope);
  EXPECT_NEAR(span.lo, 1, 1e-5);
  EXPECT_NEAR(span.hi, 1.5, 1e-5);
  const HullClipper past({{0.6F, 0.6F, -1}, {0, 0, 1}}, polytope.box, {});
  const Interval none = past.clip(polytope);
  EXPECT_GT(none.lo, none.hi);
}

TEST(HullBound, BeyondTheLargestFloatIsItsBox) {
  const Polytope polytope = fit({{}, {{{3e38, 0, 0}, {{3e38, 0, 0}, {0, 3e38, 0}, {0, 0, 3e38}}}}, 0});
  EXPECT_TRUE(polytope.planes.empty());
  EXPECT_EQ(polytope.box.hi.x, kInfinity);
}

TEST(Facets, FacesOfOnePlaneAreOne) {
  std::vector<Vec3> points;
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 4; ++y)
      for (int z = 0; z < 4; ++z) points.push_back({float(x), float(y), float(z)});
  const auto facets = facets_of(convex_hull(points), points);
  ASSERT_EQ(facets.size(), 6);
  for (const Facet& facet : facets) EXPECT_NEAR(facet.weight, 9, 1e-9);
}

TEST(Facets, SpreadTakesOpposedOnesBeforeNeighbours) {
  const std::vector<Facet> facets{{{0, 0, 1}, 1}, {{0, 0.1, 0.995}, 1.1}, {{0, 0, -1}, 1}, {{1, 0, 0}, 0.5}};
  const auto chosen = spread(facets, 3);
  ASSERT_EQ(chosen.size(), 3);
  EXPECT_EQ(chosen[0].weight, 1.1);
  EXPECT_EQ(chosen[1].normal.z, -1);
  EXPECT_EQ(chosen[2].normal.x, 1);
}

}  // namespace
}  // namespace tessera

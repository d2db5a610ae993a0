#include "core/bounds/way_to_point.h"

#include <vector>

#include <gtest/gtest.h>

namespace tessera {
namespace {

constexpr Vec3 kPoint{0, 10, 0};
constexpr Aabb kReach{{-100, -100, -100}, {100, 100, 100}};

std::vector<Ray> rays_to_point(float t_max = 1) {
  std::vector<Ray> rays;
  for (const float x : {-1.0F, 0.0F, 1.0F}) rays.push_back({{x, 0, 0}, kPoint - Vec3{x, 0, 0}, 0, t_max});
  return rays;
}

bool misses(const std::vector<Ray>& rays, const Aabb& box) { return WayToPoint(rays, kPoint, kReach, {}).misses(box); }

TEST(WayToPoint, MeetsWhatLiesBetween) {
  EXPECT_FALSE(misses(rays_to_point(), {{-0.1F, 4, -0.1F}, {0.1F, 5, 0.1F}}));
  EXPECT_FALSE(misses(rays_to_point(), {{0.9F, -1, -1}, {2, 0, 1}})) << "touches an origin";
  EXPECT_FALSE(misses(rays_to_point(), {{-1, 10, -1}, {1, 11, 1}})) << "touches the point";
}

TEST(WayToPoint, MissesWhatLiesBeside) {
  EXPECT_TRUE(misses(rays_to_point(), {{2, 0, -1}, {3, 10, 1}}));
  EXPECT_TRUE(misses(rays_to_point(), {{-1, 11, -1}, {1, 12, 1}})) << "beyond the point";
  EXPECT_TRUE(misses(rays_to_point(), {{-1, -3, -1}, {1, -2, 1}})) << "before the origins";
}

TEST(WayToPoint, RulesOutNothingForRaysThatLeadElsewhere) {
  const Aabb beside{{2, 0, -1}, {3, 10, 1}};
  EXPECT_FALSE(misses(rays_to_point(1.5F), beside)) << "they go on behind the point";
  std::vector<Ray> rays = rays_to_point();
  rays[1].direction.x = 3;
  EXPECT_FALSE(misses(rays, beside));
  rays = rays_to_point();
  rays[2].t_min = -1;
  EXPECT_FALSE(misses(rays, beside));
}

/// In floats that far from the origin, what is a rounding beside the rays isn't missed.
TEST(WayToPoint, HoldsFarFromTheOrigin) {
  const Vec3 from{1e7F, 0, 0}, to{1e7F + 4, 0, 0};
  const std::vector<Ray> rays = {{from, to - from, 0, 1}};
  const Aabb reach{{1e7F - 8, -8, -8}, {1e7F + 8, 8, 8}};
  const WayToPoint way(rays, to, reach, {});
  EXPECT_FALSE(way.misses({{1e7F + 1, 1e-6F, 0}, {1e7F + 2, 1, 1}}));
  EXPECT_TRUE(way.misses({{1e7F + 5, 0, 0}, {1e7F + 6, 1, 1}}));
}

}  // namespace
}  // namespace tessera

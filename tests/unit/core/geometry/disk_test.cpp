#include "core/geometry/disk.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/unit/core/geometry/expect_close.h"

namespace tessera {
namespace {

const Disk kFlat{{0, 1, 0}, UnitVec3::y(), 2};
const float kNotANumber = std::numeric_limits<float>::quiet_NaN();

TEST(Disk, HitFromBothSides) {
  EXPECT_EQ(intersect(kFlat, {{1, 5, 0}, {0, -1, 0}}), 4.0F);
  EXPECT_EQ(intersect(kFlat, {{1, -5, 0}, {0, 2, 0}}), 3.0F);
  EXPECT_EQ(intersect(kFlat, {{1, 5, 0}, {0, 1, 0}}), std::nullopt);
}

TEST(Disk, RimIsClosed) {
  EXPECT_EQ(intersect(kFlat, {{2, 5, 0}, {0, -1, 0}}), 4.0F);
  EXPECT_EQ(intersect(kFlat, {{std::nextafter(2.0F, 3.0F), 5, 0}, {0, -1, 0}}), std::nullopt);
}

TEST(Disk, Stress34_ParallelRaysMiss) {
  EXPECT_EQ(intersect(kFlat, {{-5, 1, 0}, {1, 0, 0}}), std::nullopt);
  EXPECT_EQ(intersect(kFlat, {{-5, 1.5F, 0}, {1, 0, 0}}), std::nullopt);
  EXPECT_EQ(intersect(kFlat, {{0, 1, 0}, {1, 0, 0}}), std::nullopt);
}

TEST(Disk, Stress34_NearlyParallelRaysAtALargeDiskHit) {
  const Disk ground{{0, 0, 0}, UnitVec3::y(), 1e8F};
  for (const float slope : {1e-3F, 1e-5F, 1e-7F}) {
    const auto t = intersect(ground, {{0, 1, 0}, {1, -slope, 0}});
    ASSERT_TRUE(t) << slope;
    EXPECT_FLOAT_EQ(*t, 1 / slope);
  }
  EXPECT_EQ(intersect(ground, {{0, 1, 0}, {1, -1e-9F, 0}}), std::nullopt);  // meets the plane beyond the rim
}

TEST(Disk, Stress07And09_UntraceableRaysMiss) {
  for (const float bad : {kNotANumber, kInfinity, -kInfinity})
    for (int axis = 0; axis < 3; ++axis) {
      Ray ray{{1, 5, 0}, {0, -1, 0}};
      ray.origin[axis] = bad;
      EXPECT_EQ(intersect(kFlat, ray), std::nullopt) << bad << " in origin, axis " << axis;
      ray = {{1, 5, 0}, {0, -1, 0}};
      ray.direction[axis] = bad;
      EXPECT_EQ(intersect(kFlat, ray), std::nullopt) << bad << " in direction, axis " << axis;
    }
  EXPECT_EQ(intersect(kFlat, {{1, 5, 0}, {0, -1, 0}, kNotANumber}), std::nullopt);
  EXPECT_EQ(intersect(kFlat, {{1, 5, 0}, {0, 0, 0}}), std::nullopt);
}

TEST(Disk, SurfaceHasTheGivenNormal) {
  const SurfacePoint below = surface(kFlat, {{1, -5, 0}, {0, 2, 0}}, 3);
  expect_close(below.position, {1, 1, 0});
  expect_close(below.geometric_normal, {0, 1, 0});
}

TEST(Disk, Bounds) {
  const Aabb box = bounds(kFlat);
  EXPECT_TRUE(box.contains(Aabb{{-2, 1, -2}, {2, 1, 2}}));
  EXPECT_LT(box.diagonal().y, 1e-6F);
  EXPECT_NEAR(box.diagonal().x, 4, 2e-6);
}

}  // namespace
}  // namespace tessera

#include "core/math/ray.h"

#include <gtest/gtest.h>

#include "core/math/interval.h"

namespace tessera {
namespace {

const float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(Ray, Stress07And09_OnlyProperRaysAreTraceable) {
  const Ray good{{1, 2, 3}, {0, 0, -1}};
  EXPECT_TRUE(is_traceable(good));
  EXPECT_TRUE(is_traceable({{1, 2, 3}, {0, 0, 1e-45F}}));
  for (int axis = 0; axis < 3; ++axis)
    for (const float bad : {kNan, kInfinity, -kInfinity}) {
      Ray ray = good;
      ray.origin[axis] = bad;
      EXPECT_FALSE(is_traceable(ray)) << "origin " << axis << ' ' << bad;
      ray = good;
      ray.direction[axis] = bad;
      EXPECT_FALSE(is_traceable(ray)) << "direction " << axis << ' ' << bad;
    }
  EXPECT_FALSE(is_traceable({{1, 2, 3}, {0, 0, 0}}));
  EXPECT_FALSE(is_traceable({{1, 2, 3}, {-0.0F, 0, 0}}));
}

TEST(Ray, Stress08_EmptyIntervalsAreNotTraceable) {
  const Vec3 o{}, d{0, 0, 1};
  EXPECT_FALSE(is_traceable({o, d, 1, 1}));
  EXPECT_FALSE(is_traceable({o, d, 2, 1}));
  EXPECT_FALSE(is_traceable({o, d, kNan, 1}));
  EXPECT_FALSE(is_traceable({o, d, 0, kNan}));
  EXPECT_TRUE(is_traceable({o, d, -1, kInfinity}));
}

TEST(Interval, Intersection) {
  EXPECT_EQ(intersect(Interval{0, 3}, Interval{2, 5}), (Interval{2, 3}));
  EXPECT_FALSE(intersect(Interval{0, 2}, Interval{2, 5}).empty());
  EXPECT_TRUE(intersect(Interval{0, 1}, Interval{2, 5}).empty());
  EXPECT_TRUE((Interval{kNan, 1}).empty());
  EXPECT_FALSE(Interval{}.empty());
}

}  // namespace
}  // namespace tessera

#include "core/math/ray.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

const float kNanFloat = std::numeric_limits<float>::quiet_NaN();

TEST(Ray, Stress07And09_OnlyProperRaysAreTraceable) {
  const Ray good{{1, 2, 3}, {0, 0, -1}};
  EXPECT_TRUE(is_traceable(good));
  EXPECT_TRUE(is_traceable({{1, 2, 3}, {0, 0, 1e-45F}}));
  for (int axis = 0; axis < 3; ++axis)
    for (const float bad : {kNanFloat, kInfinity, -kInfinity}) {
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
  EXPECT_FALSE(is_traceable({o, d, kNanFloat, 1}));
  EXPECT_FALSE(is_traceable({o, d, 0, kNanFloat}));
  EXPECT_TRUE(is_traceable({o, d, -1, kInfinity}));
}

}  // namespace
}  // namespace tessera

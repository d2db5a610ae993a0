#include "core/math/unit_vec3.h"

#include <limits>

#include <gtest/gtest.h>

#include "core/math/rounding.h"

namespace tessera {
namespace {

TEST(UnitVec3, Normalises) {
  EXPECT_EQ(UnitVec3::normalize(Vec3{0, -3, 0})->vec(), (Vec3{0, -1, 0}));
  EXPECT_EQ(UnitVec3::normalize(Vec3d{3, 0, 4})->vec(), (Vec3{0.6F, 0, 0.8F}));
}

TEST(UnitVec3, AnyLengthThatAFloatHolds) {
  for (const float size : {1e-45F, 1e-38F, 1e-20F, 1e20F, 1e38F}) {
    const auto v = UnitVec3::normalize(Vec3{size, size, 0});
    ASSERT_TRUE(v) << size;
    EXPECT_NEAR(length(to_double(v->vec())), 1, 1e-7) << size;
    EXPECT_EQ(v->vec().x, v->vec().y) << size;
  }
}

TEST(UnitVec3, NoDirectionWithoutLength) {
  EXPECT_FALSE(UnitVec3::normalize(Vec3{}));
  for (int axis = 0; axis < 3; ++axis)
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity}) {
      Vec3 v{1, 1, 1};
      v[axis] = bad;
      EXPECT_FALSE(UnitVec3::normalize(v)) << bad << ' ' << axis;
    }
}

}  // namespace
}  // namespace tessera

#include "core/math/transform.h"

#include <limits>

#include <gtest/gtest.h>

namespace tessera {
namespace {

using Rows = std::array<double, 12>;
constexpr Rows kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

TEST(Transform, RayKeepsItsT) {
  // Twice as large, then moved by (10, 20, 30).
  const auto placement = Transform::from_rows({2, 0, 0, 10, 0, 2, 0, 20, 0, 0, 2, 30});
  ASSERT_TRUE(placement);
  const Ray local = placement->to_local({{14, 20, 30}, {1, 0, -4}, 0.5F, 7});
  EXPECT_EQ(local.origin, (Vec3{2, 0, 0}));
  EXPECT_EQ(local.direction, (Vec3{0.5F, 0, -2}));
  EXPECT_EQ(local.t_min, 0.5F);
  EXPECT_EQ(local.t_max, 7);
  EXPECT_EQ(placement->point_to_world({2, 0, 0}), (Vec3d{14, 20, 30}));
}

TEST(Transform, TracedRowsAreTheInverseOfTheFloatInverse) {
  const auto placement = Transform::from_rows({3, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
  ASSERT_TRUE(placement);
  EXPECT_EQ(placement->rows()[0], 1 / static_cast<double>(1.0F / 3));
}

TEST(Transform, NormalsUseTheInverseTranspose) {
  const auto squeezed = Transform::from_rows({1, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1, 0});
  EXPECT_EQ(squeezed->normal_to_world({1, 1, 0}), (Vec3d{1, 2, 0}));
  const auto mirrored = Transform::from_rows({-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
  EXPECT_EQ(mirrored->normal_to_world({1, 0, 0}), (Vec3d{-1, 0, 0}));
}

TEST(Transform, Stress35_SingularMatricesAreRefused) {
  EXPECT_FALSE(Transform::from_rows({}));
  EXPECT_FALSE(Transform::from_rows({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0}));
  EXPECT_FALSE(Transform::from_rows({1, 2, 3, 0, 2, 4, 6, 0, 0, 0, 1, 0}));
  // Singular but for rounding.
  EXPECT_FALSE(Transform::from_rows({0.1, 0.2, 0.3, 0, 0.4, 0.5, 0.6, 0, 0.7, 0.8, 0.9, 0}));
  // A scale alone never makes a matrix singular, however small.
  EXPECT_TRUE(Transform::from_rows({1e-12, 0, 0, 0, 0, 1e-12, 0, 0, 0, 0, 1e-12, 0}));
  EXPECT_TRUE(Transform::from_rows({1e4, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1e-4, 0}));
}

TEST(Transform, NumbersThatDoNotFitAreRefused) {
  for (std::size_t i = 0; i < 12; ++i)
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      Rows rows = kIdentity;
      rows[i] = bad;
      EXPECT_FALSE(Transform::from_rows(rows)) << "entry " << i;
    }
  EXPECT_FALSE(Transform::from_rows({1e-42, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}));  // its inverse overflows a float
}

TEST(Transform, ErrorOfTheIdentity) {
  const Transform::Error error = Transform::from_rows(kIdentity)->error();
  EXPECT_EQ(error.condition, 1);
  EXPECT_EQ(error.offset, 0);
}

}  // namespace
}  // namespace tessera

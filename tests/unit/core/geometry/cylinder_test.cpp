#include "core/geometry/cylinder.h"

#include <gtest/gtest.h>

#include "tests/unit/core/geometry/expect_close.h"

namespace tessera {
namespace {

constexpr Cylinder kUpright{{0, 0, 0}, {0, 4, 0}, 1};

TEST(Cylinder, NearAndFarWall) {
  EXPECT_EQ(intersect(kUpright, {{-5, 1, 0}, {1, 0, 0}}), 4.0F);
  EXPECT_EQ(intersect(kUpright, {{-5, 1, 0}, {1, 0, 0}, 4}), 6.0F);
  EXPECT_EQ(intersect(kUpright, {{0, 1, 0}, {0, 0, 4}}), 0.25F);
  EXPECT_EQ(intersect(kUpright, {{-5, 1, 1.001F}, {1, 0, 0}}), std::nullopt);
}

TEST(Cylinder, NoCaps) {
  EXPECT_EQ(intersect(kUpright, {{0.5F, 9, 0}, {0, -1, 0}}), std::nullopt);
  // In through the open top, onto the wall inside: falls 1 for each 1 sideways.
  EXPECT_FLOAT_EQ(*intersect(kUpright, {{0, 5, 0}, {1, -2, 0}}), 1.0F);
}

TEST(Cylinder, EndsAreClosed) {
  EXPECT_EQ(intersect(kUpright, {{-5, 0, 0}, {1, 0, 0}}), 4.0F);
  EXPECT_EQ(intersect(kUpright, {{-5, 4, 0}, {1, 0, 0}}), 4.0F);
  EXPECT_EQ(intersect(kUpright, {{-5, 4.000001F, 0}, {1, 0, 0}}), std::nullopt);
}

TEST(Cylinder, RayAlongTheAxisMisses) {
  EXPECT_EQ(intersect(kUpright, {{0, -1, 0}, {0, 1, 0}}), std::nullopt);
  EXPECT_EQ(intersect(kUpright, {{3, -1, 0}, {0, 1, 0}}), std::nullopt);
}

TEST(Cylinder, SurfaceLooksOutward) {
  const Ray ray{{-5, 1, 0}, {1, 0, 0}};
  expect_close(surface(kUpright, ray, 4).position, {-1, 1, 0});
  expect_close(surface(kUpright, ray, 4).geometric_normal, {-1, 0, 0});
  expect_close(surface(kUpright, ray, 6).geometric_normal, {1, 0, 0});
}

TEST(Cylinder, Bounds) {
  const Aabb box = bounds(kUpright);
  EXPECT_TRUE(box.contains(Aabb{{-1, 0, -1}, {1, 4, 1}}));
  EXPECT_NEAR(box.diagonal().x, 2, 1e-6);
  EXPECT_NEAR(box.diagonal().y, 4, 1e-6);
}

}  // namespace
}  // namespace tessera

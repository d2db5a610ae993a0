#include "core/accel/convex_cell.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

const Aabb kCube{{0, 0, 0}, {2, 2, 2}};

TEST(ConvexCell, IsTheBoxAtFirst) {
  const ConvexCell cell(kCube);
  EXPECT_DOUBLE_EQ(cell.half_surface(), half_area(kCube));
  EXPECT_TRUE(cell.box().contains(kCube));
  EXPECT_EQ(cell.extent({1, 1, 0}), std::make_pair(0.0, 4.0));
}

TEST(ConvexCell, IsCutInTwoByAnyPlane) {
  const auto [below, above] = ConvexCell(kCube).parts({{1, 0, 0}, 0.5F});
  EXPECT_DOUBLE_EQ(below.half_surface(), 0.5 * 2 + 0.5 * 2 + 4);
  EXPECT_DOUBLE_EQ(above.half_surface(), 1.5 * 2 + 1.5 * 2 + 4);
  // A corner: three right triangles of legs 1 and the equilateral one over their hypotenuses.
  const auto [corner, rest] = ConvexCell(kCube).parts({{1, 1, 1}, 1});
  EXPECT_NEAR(corner.half_surface(), (1.5 + std::sqrt(3.0) / 2) / 2, 1e-12);
  EXPECT_NEAR(rest.half_surface(), (24 - 1.5 + std::sqrt(3.0) / 2) / 2, 1e-12);
  const auto [all, none] = ConvexCell(kCube).parts({{1, 0, 0}, 5});
  EXPECT_DOUBLE_EQ(all.half_surface(), half_area(kCube));
  EXPECT_TRUE(none.box().empty());
}

TEST(ConvexCell, StaysSmallAfterManyCutsThroughOnePoint) {
  Random random(1);
  ConvexCell cell(kCube);
  double surface = cell.half_surface();
  for (int i = 0; i < 60; ++i) {
    // The planes all but meet in a corner of the cell, where their cuts crowd.
    const Vec3 normal = to_float(random.direction());
    auto [below, above] = cell.parts({normal, normal.x + normal.y + normal.z});
    cell = below.half_surface() > above.half_surface() ? std::move(below) : std::move(above);
    EXPECT_LE(cell.half_surface(), surface * (1 + 1e-9)) << "a part of a convex body has less surface";
    surface = cell.half_surface();
    EXPECT_LE(cell.corner_count(), 400U) << "cut " << i;
  }
}

}  // namespace
}  // namespace tessera

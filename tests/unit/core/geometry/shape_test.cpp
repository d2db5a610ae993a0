#include "core/geometry/shape.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

TriangleMesh two_triangles() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 5}, {99, 99, 99}}, {{0, 1, 2}, {0, 1, 3}}, {}};
}

TEST(Shape, PrimitiveCount) {
  EXPECT_EQ(primitive_count(two_triangles()), 2U);
  EXPECT_EQ(primitive_count(TriangleMesh{}), 0U);
  EXPECT_EQ(primitive_count(Sphere{}), 1U);
  EXPECT_EQ(primitive_count(Quad{}), 1U);
}

TEST(Shape, MeshBoundsCountUsedVerticesOnly) {
  EXPECT_EQ(bounds(Shape{two_triangles()}), (Aabb{{0, 0, 0}, {1, 1, 5}}));
  EXPECT_TRUE(bounds(Shape{TriangleMesh{}}).empty());
  TriangleMesh unused = two_triangles();
  unused.triangles.clear();
  EXPECT_TRUE(bounds(Shape{unused}).empty());
}

TEST(Shape, BoundsOfTheOthersAreTheirOwn) {
  const Sphere sphere{{1, 2, 3}, 4};
  EXPECT_EQ(bounds(Shape{sphere}), bounds(sphere));
  const Disk disk{{1, 2, 3}, UnitVec3::x(), 4};
  EXPECT_EQ(bounds(Shape{disk}), bounds(disk));
}

}  // namespace
}  // namespace tessera

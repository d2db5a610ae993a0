#include "core/geometry/shape_outline.h"

#include <gtest/gtest.h>

#include "core/bounds/box_bound.h"

namespace tessera {
namespace {

Aabb box(Outline outline) { return BoxBound().fit(outline); }

void expect_close(const Aabb& a, const Aabb& b) {
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(a.lo[axis], b.lo[axis], 1e-5);
    EXPECT_NEAR(a.hi[axis], b.hi[axis], 1e-5);
  }
}

TEST(ShapeOutline, OfAMeshIsWhatTrianglesUseOnce) {
  const TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {9, 9, 9}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 3}, {1, 4, 3}}, {}};
  const Outline points = outline(Shape(mesh));
  EXPECT_EQ(points.points, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}));
  EXPECT_EQ(points.slack, 0);
  EXPECT_TRUE(outline(Shape(TriangleMesh{{{1, 2, 3}}, {}, {}})).empty());
}

TEST(ShapeOutline, HasTheShapesOwnBox) {
  const Shape shapes[] = {Sphere{{1, 2, 3}, 4},
                          Cylinder{{1, 2, 3}, {4, -5, 6}, 2},
                          Cone{{1, 2, 3}, 2, {4, -5, 6}, 0},
                          Disk{{1, 2, 3}, *UnitVec3::normalize(Vec3{1, 1, -2}), 3},
                          Disk{{1, 2, 3}, UnitVec3::y(), 3},
                          Quad{{{{0, 0, 0}, {1, 0, 0}, {1, 1, 1}, {0, 2, 1}}}}};
  for (const Shape& shape : shapes) {
    SCOPED_TRACE(shape.index());
    expect_close(box(outline(shape)), bounds(shape));
  }
}

/// Hits at a cone's tip lie a little outside of it: the box and the outline agree on how much.
TEST(ShapeOutline, AllowsForHitsBesideATip) {
  const Cone cone{{0, 0, 0}, 1, {0, 0, 1}, 0};
  const Outline circles = outline(Shape(cone));
  ASSERT_EQ(circles.ellipsoids.size(), 2);
  EXPECT_EQ(length(circles.ellipsoids[1].axes[0]), hit_radius(cone, 0));
  EXPECT_GT(hit_radius(cone, 0), 0x1p-25);
}

}  // namespace
}  // namespace tessera

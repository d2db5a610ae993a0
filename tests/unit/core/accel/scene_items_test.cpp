#include "core/accel/scene_items.h"

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace tessera {
namespace {

constexpr double kTurn = 0.70710678118654752;  // by 45 degrees

/// A turn by 45 degrees about an axis makes its box narrower, and the box of its box's corners √2 times as wide.
TriangleMesh octahedron() {
  return {{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
          {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}},
          {}};
}

Aabb box_of(const std::array<double, 12>& rows) {
  SceneBuilder builder;
  const auto scene = builder.place(builder.shape(octahedron()), 0, placed(rows)).build();
  return ObjectItems(*scene, AccelOptions()).boxes()[0];
}

void expect_tight(const Aabb& box, Vec3d lo, Vec3d hi) {
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_LE(box.lo[axis], lo[axis]) << axis;
    EXPECT_GE(box.hi[axis], hi[axis]) << axis;
    EXPECT_NEAR(box.lo[axis], lo[axis], 1e-5) << axis;
    EXPECT_NEAR(box.hi[axis], hi[axis], 1e-5) << axis;
  }
}

TEST(ObjectItems, BoxesOfInstancesFitTheirPoints) {
  expect_tight(box_of({kTurn, kTurn, 0, 5, -kTurn, kTurn, 0, 0, 0, 0, 1, 0}), {5 - kTurn, -kTurn, -1},
               {5 + kTurn, kTurn, 1});
}

TEST(ObjectItems, BoxesAreCarriedAlongTheAxes) {
  // x and y change places, z is turned over.
  expect_tight(box_of({0, 3, 0, 5, 2, 0, 0, 6, 0, 0, -4, 7}), {2, 4, 3}, {8, 8, 11});
}

/// Ten million metres there and back, which a float's ulp about the origin doesn't allow for.
TEST(ObjectItems, BoxesAllowForTheRoundingOfPlacements) {
  SceneBuilder builder;
  const float far = 1e7F;
  const std::uint32_t shape = builder.shape(TriangleMesh{{{far, 0, 0}, {far, 1, 0}, {far, 0, 1}}, {{0, 1, 2}}, {}});
  const auto scene = builder.place(shape, 0, placed({1 / 3.0, 0, 0, -far / 3.0, 0, 1, 0, 0, 0, 0, 1, 0})).build();
  const Aabb box = ObjectItems(*scene, AccelOptions()).boxes()[0];
  const Vec3d at = scene->objects[0].placement->point_to_world({far, 0, 0});
  EXPECT_LT(box.lo.x, at.x - 1e-9);
  EXPECT_GT(box.hi.x, at.x + 1e-9);
}

}  // namespace
}  // namespace tessera

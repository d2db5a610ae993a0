#include "core/scene/shape_boxes.h"

#include <thread>

#include <gtest/gtest.h>

#include "core/scene/scene.h"
#include "tests/support/meshes.h"

namespace tessera {
namespace {

const std::vector<Shape> kShapes = {Sphere{{1, 2, 3}, 1}, TriangleMesh{}, grid_plane(3)};

TEST(ShapeBoxes, AreTheShapes) {
  const ShapeBoxes boxes;
  const std::span<const Aabb> all = boxes.of(kShapes);
  ASSERT_EQ(all.size(), 3);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(all[i].lo, bounds(kShapes[i]).lo) << i;
    EXPECT_EQ(all[i].hi, bounds(kShapes[i]).hi) << i;
  }
  EXPECT_TRUE(ShapeBoxes().of({}).empty());
}

TEST(ShapeBoxes, AreLookedThroughOnceHoweverManyAsk) {
  const ShapeBoxes boxes;
  std::vector<const Aabb*> seen(8);
  {
    std::vector<std::jthread> asking;
    for (const Aabb*& its : seen) asking.emplace_back([&] { its = boxes.of(kShapes).data(); });
  }
  for (const Aabb* its : seen) EXPECT_EQ(its, seen[0]);
}

TEST(ShapeBoxes, OfACopyAreItsOwn) {
  const auto expect_own = [](const Scene& scene) { EXPECT_EQ(local_bounds(scene)[0].hi, bounds(scene.shapes[0]).hi); };
  Scene scene, assigned;
  scene.shapes = {Sphere{{0, 0, 0}, 1}};
  assigned.shapes = {Sphere{{0, 0, 0}, 2}};
  expect_own(scene);
  expect_own(assigned);
  Scene copy = scene;
  copy.shapes = {Sphere{{0, 0, 0}, 3}};
  assigned = scene;
  expect_own(copy);
  expect_own(assigned);
  expect_own(scene);

  scene.shapes.push_back(grid_plane(2));
  EXPECT_EQ(local_bounds(scene).size(), 2) << "while it is made, shapes may be added";
}

}  // namespace
}  // namespace tessera

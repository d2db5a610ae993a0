#include "core/scene/scene.h"

#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/meshes.h"

namespace tessera {
namespace {

TEST(LocalBounds, AreThoseOfTheShapes) {
  Scene scene;
  scene.shapes = {Sphere{{1, 2, 3}, 1}, TriangleMesh{}, grid_plane(3)};
  scene = with_bounds(std::move(scene));
  ASSERT_EQ(local_bounds(scene).size(), 3U);
  EXPECT_EQ(local_bounds(scene)[0].lo, bounds(Sphere{{1, 2, 3}, 1}).lo);
  EXPECT_EQ(local_bounds(scene)[0].hi, bounds(Sphere{{1, 2, 3}, 1}).hi);
  EXPECT_TRUE(local_bounds(scene)[1].empty());
  EXPECT_EQ(local_bounds(scene)[2].hi, bounds(scene.shapes[2]).hi);
  EXPECT_TRUE(local_bounds(Scene()).empty());
}

TEST(LocalBounds, OfShapesThatChangedAreMadeAnew) {
  Scene scene;
  scene.shapes = {Sphere{{0, 0, 0}, 1}};
  scene = with_bounds(std::move(scene));
  scene.shapes.front() = Sphere{{0, 0, 0}, 2};
  EXPECT_EQ(local_bounds(with_bounds(scene))[0].hi, bounds(Sphere{{0, 0, 0}, 2}).hi);

  scene.shapes.emplace_back(Sphere{{0, 0, 0}, 3});
  EXPECT_THROW(local_bounds(scene), std::logic_error) << "a shape was added since";
  EXPECT_EQ(local_bounds(with_bounds(scene))[1].hi, bounds(Sphere{{0, 0, 0}, 3}).hi);
}

}  // namespace
}  // namespace tessera

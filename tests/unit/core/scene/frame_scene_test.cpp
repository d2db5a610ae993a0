#include "core/scene/frame_scene.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/screen/camera_rays.h"

namespace tessera {
namespace {

/// Every corner of the box inside a square image.
void expect_framed(const Scene& scene, const Aabb& box) {
  const CameraRays rays(frame_scene(scene), 100, 100);
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p{corner & 1 ? box.hi.x : box.lo.x, corner & 2 ? box.hi.y : box.lo.y, corner & 4 ? box.hi.z : box.lo.z};
    const auto seen = rays.project(to_double(p));
    EXPECT_GT(seen.depth, 0);
    EXPECT_TRUE(seen.x >= 0 && seen.x <= 100 && seen.y >= 0 && seen.y <= 100) << seen.x << ' ' << seen.y;
  }
}

Scene scene_of(const Shape& shape) {
  Scene scene;
  scene.shapes = {shape};
  scene.objects = {{0, 0, std::nullopt}};
  scene.materials.emplace_back();
  return scene;
}

TEST(FrameScene, LooksAtTheMiddleFromAboveAndRight) {
  const auto camera = std::get<PerspectiveCamera>(frame_scene(scene_of(Sphere{{1, 2, 3}, 1})));
  EXPECT_LT(length(camera.view.at - Vec3{1, 2, 3}), 1e-6F);
  EXPECT_GT(camera.view.from.x, 1);
  EXPECT_GT(camera.view.from.y, 2);
  EXPECT_GT(camera.view.from.z - 3, camera.view.from.x - 1);
  EXPECT_EQ(camera.view.up, (Vec3{0, 1, 0}));
}

TEST(FrameScene, AllOfIt) {
  expect_framed(scene_of(Sphere{{1, 2, 3}, 0.5F}), {{0.5F, 1.5F, 2.5F}, {1.5F, 2.5F, 3.5F}});
  expect_framed(scene_of(Quad{{{{0, 0, 0}, {9, 0, 0}, {9, 0, 5}, {0, 0, 5}}}}), {{0, 0, 0}, {9, 0, 5}});
  expect_framed(scene_of(Sphere{{1e7F, 0, -1e7F}, 2}), {{1e7F - 2, -2, -1e7F - 2}, {1e7F + 2, 2, -1e7F + 2}});
  expect_framed(scene_of(Sphere{{0, 0, 0}, 1e-15F}), {{-1e-15F, -1e-15F, -1e-15F}, {1e-15F, 1e-15F, 1e-15F}});
  expect_framed(scene_of(Sphere{{0, 0, 0}, 1e15F}), {{-1e15F, -1e15F, -1e15F}, {1e15F, 1e15F, 1e15F}});
}

TEST(FrameScene, InstancesCountWhereTheyStand) {
  Scene scene = scene_of(Sphere{});
  scene.objects.push_back({0, 0, Transform::from_rows({1, 0, 0, 50, 0, 1, 0, 0, 0, 0, 1, 0})});
  expect_framed(scene, {{-1, -1, -1}, {51, 1, 1}});
}

TEST(FrameScene, AUnitCubeStandsInForNothing) {
  const auto camera = std::get<PerspectiveCamera>(frame_scene({}));
  EXPECT_EQ(camera.view.at, (Vec3{0, 0, 0}));
  expect_framed({}, {{-0.5F, -0.5F, -0.5F}, {0.5F, 0.5F, 0.5F}});
  expect_framed(scene_of(TriangleMesh{}), {{-0.5F, -0.5F, -0.5F}, {0.5F, 0.5F, 0.5F}});
}

}  // namespace
}  // namespace tessera

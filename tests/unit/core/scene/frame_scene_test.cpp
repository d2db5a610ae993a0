#include "core/scene/frame_scene.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/screen/camera_rays.h"
#include "tests/support/meshes.h"
#include "tests/support/random.h"

namespace tessera {
namespace {

struct Size {
  std::uint32_t width, height;
};
constexpr Size kSizes[] = {{100, 100}, {100, 400}, {400, 100}, {1, 1000}, {1000, 1}, {16, 9}, {1, 1}};

/// Cameras of every kind that wait to be placed.
std::vector<Camera> cameras() {
  std::vector<Camera> all{kUnplacedCamera, OrthographicCamera{kUnplacedView}};
  for (const float degrees : {1.0F, 45.0F, 170.0F})
    all.push_back(PerspectiveCamera{{{0, 0, 0}, {0.2F, -1, 0.3F}, {0, 0, 1}, false},
                                    static_cast<float>(degrees * std::numbers::pi / 180)});
  all.push_back(OrthographicCamera{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, false}});
  PerspectiveCamera calibrated{kUnplacedView};
  calibrated.intrinsics = Intrinsics{150, 90, 70, 20};
  all.push_back(calibrated);
  calibrated.intrinsics = Intrinsics{50, 50, -60, 300};  // seen aslant: the axis passes beside most images
  all.push_back(calibrated);
  return all;
}

/// The part of the image that points take, in what the margin leaves of it: 0 to 1 across and down.
struct Taken {
  double left = 1, right = 0, top = 1, bottom = 0;
};

Taken taken(const Camera& camera, Size size, const std::vector<Vec3d>& points) {
  const CameraRays rays(camera, size.width, size.height);
  const double smaller = std::min(size.width, size.height);
  const double margin = std::min(std::max(0.04 * smaller, 1.0), smaller / 4);
  Taken out;
  for (const Vec3d p : points) {
    const auto seen = rays.project(p);
    EXPECT_GT(seen.depth, 0);
    const double x = (seen.x - margin) / (size.width - 2 * margin), y = (seen.y - margin) / (size.height - 2 * margin);
    out = {std::min(out.left, x), std::max(out.right, x), std::min(out.top, y), std::max(out.bottom, y)};
  }
  return out;
}

/// All points within the margin, and two opposite sides touched.
void expect_framed(const Scene& scene, const std::vector<Vec3d>& points, double off = 0.02) {
  const bool is_ball = scene.shapes.size() == 1 && std::holds_alternative<Sphere>(scene.shapes.front());
  for (const Camera& wanted : cameras())
    for (const Size size : kSizes) {
      const Camera camera = frame_scene(scene, size.width, size.height, wanted);
      const Taken part = taken(camera, size, points);
      const std::string what = std::to_string(size.width) + "x" + std::to_string(size.height) + ", camera of kind " +
                               std::to_string(wanted.index());
      EXPECT_TRUE(part.left > -off && part.right < 1 + off && part.top > -off && part.bottom < 1 + off)
          << what << ": " << part.left << " to " << part.right << ", " << part.top << " to " << part.bottom;
      // A camera that sees more than a corner's own angle would have to stand on it to fill the image.
      const auto* pinhole = std::get_if<PerspectiveCamera>(&wanted);
      if (pinhole && pinhole->vertical_fov > 1 && !is_ball) continue;
      EXPECT_GT(std::max(part.right - part.left, part.bottom - part.top), 1 - 2 * off) << what;
      EXPECT_FLOAT_EQ(std::visit([](const auto& c) { return c.view.up.y; }, camera),
                      std::visit([](const auto& c) { return c.view.up.y; }, wanted));
    }
}

Scene scene_of(const Shape& shape) {
  Scene scene;
  scene.shapes = {shape};
  scene.objects = {{0, 0, std::nullopt}};
  scene.materials.emplace_back();
  return with_bounds(std::move(scene));
}

std::vector<Vec3d> corners(Vec3d lo, Vec3d hi) {
  std::vector<Vec3d> out;
  for (int i = 0; i < 8; ++i) out.push_back({i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z});
  return out;
}

std::vector<Vec3d> on_ball(Vec3d center, double radius) {
  Random random(8);
  std::vector<Vec3d> out;
  for (int i = 0; i < 20'000; ++i) out.push_back(center + random.direction() * radius);
  return out;
}

std::vector<Vec3d> vertices(const TriangleMesh& mesh) {
  std::vector<Vec3d> out;
  for (const Vec3 p : mesh.positions) out.push_back(to_double(p));
  return out;
}

TEST(FrameScene, LooksFromAboveAndRightByDefault) {
  const auto camera = std::get<PerspectiveCamera>(frame_scene(scene_of(Sphere{{1, 2, 3}, 1}), 100, 100));
  EXPECT_LT(length(camera.view.at - Vec3{1, 2, 3}), 1e-5F);
  EXPECT_GT(camera.view.from.x, 1);
  EXPECT_GT(camera.view.from.y, 2);
  EXPECT_GT(camera.view.from.z - 3, camera.view.from.x - 1);
  EXPECT_EQ(camera.view.up, (Vec3{0, 1, 0}));
  EXPECT_TRUE(camera.view.is_placed);
}

TEST(FrameScene, LeavesAPlacedCameraAlone) {
  const PerspectiveCamera placed{{{1, 2, 3}, {4, 5, 6}, {0, 0, 1}}, 0.5F};
  const auto camera = std::get<PerspectiveCamera>(frame_scene(scene_of(Sphere{}), 100, 400, placed));
  EXPECT_EQ(camera.view.from, placed.view.from);
  EXPECT_EQ(camera.view.at, placed.view.at);
  EXPECT_EQ(camera.vertical_fov, 0.5F);
}

TEST(FrameScene, KeepsDirectionAndFieldOfView) {
  const PerspectiveCamera wanted{{{0, 0, 0}, {0, -3, 0}, {0, 0, 1}, false}, 0.3F};
  const auto camera = std::get<PerspectiveCamera>(frame_scene(scene_of(Sphere{{1, 2, 3}, 1}), 100, 200, wanted));
  EXPECT_EQ(camera.vertical_fov, 0.3F);
  const Vec3d way = to_double(camera.view.at) - to_double(camera.view.from);
  EXPECT_NEAR(way.y / length(way), -1, 1e-6);
}

TEST(FrameScene, FillsImagesOfEveryAspect) {
  expect_framed(scene_of(Sphere{{1, 2, 3}, 0.5F}), on_ball({1, 2, 3}, 0.5));
  expect_framed(scene_of(icosphere(2)), vertices(icosphere(2)));
  expect_framed(scene_of(Quad{{{{0, 0, 0}, {9, 0, 0}, {9, 0, 5}, {0, 0, 5}}}}),
                {{0, 0, 0}, {9, 0, 0}, {9, 0, 5}, {0, 0, 5}});
  expect_framed(scene_of(Quad{{{{0, 0, 0}, {0, 0, 1}, {90, 0, 1}, {90, 0, 0}}}}),
                {{0, 0, 0}, {90, 0, 0}, {90, 0, 1}, {0, 0, 1}});
}

TEST(FrameScene, AtEverySizeAndPlace) {
  for (const float size : {1e-30F, 1e-15F, 1e15F}) expect_framed(scene_of(Sphere{{0, 0, 0}, size}), on_ball({}, size));
  expect_framed(scene_of(icosphere(2, 1e15F, {1e15F, 1e15F, -1e15F})),
                vertices(icosphere(2, 1e15F, {1e15F, 1e15F, -1e15F})), 0.05);
  // Where floats are a metre apart, the camera has to keep so much farther away: all is in view, if not as large.
  const Vec3d far{1e7, 0, -1e7};
  for (const Camera& wanted : cameras())
    for (const Size size : {kSizes[0], kSizes[1], kSizes[2]}) {
      const Scene scene = scene_of(Sphere{to_float(far), 20});
      const Taken part = taken(frame_scene(scene, size.width, size.height, wanted), size, on_ball(far, 20));
      EXPECT_TRUE(part.left > 0 && part.right < 1 && part.top > 0 && part.bottom < 1);
    }
}

/// What else a camera has stays as it is.
TEST(FrameScene, KeepsLensAndClipping) {
  PerspectiveCamera wanted{kUnplacedView};
  wanted.lens = {0.25F, 3};
  wanted.clipping = {0.5F, 40};
  const Scene scene = scene_of(icosphere(2));
  const auto framed = std::get<PerspectiveCamera>(frame_scene(scene, 64, 48, wanted));
  EXPECT_TRUE(framed.view.is_placed);
  EXPECT_EQ(framed.lens.radius, 0.25F);
  EXPECT_EQ(framed.lens.focus_distance, 3);
  EXPECT_EQ(framed.clipping.near, 0.5F);
  EXPECT_EQ(framed.clipping.far, 40);
  const auto pinhole = std::get<PerspectiveCamera>(frame_scene(scene, 64, 48));
  EXPECT_EQ(framed.view.from, pinhole.view.from) << "what is in focus is framed";
}

TEST(FrameScene, InstancesCountWhereTheyStand) {
  Scene scene = scene_of(icosphere(2));
  scene.objects.push_back({0, 0, Transform::from_rows({1, 0, 0, 50, 0, 2, 0, 0, 0, 0, 1, 0})});
  std::vector<Vec3d> points = vertices(icosphere(2));
  for (const Vec3 p : icosphere(2).positions) points.push_back(to_double(p) + Vec3d{50, double{p.y}, 0});
  expect_framed(scene, points);
}

TEST(FrameScene, AUnitCubeStandsInForNothing) {
  const std::vector<Vec3d> cube = corners({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5});
  expect_framed({}, cube);
  expect_framed(scene_of(TriangleMesh{}), cube);
}

TEST(FrameScene, PointsAndLinesAreInView) {
  const TriangleMesh point{{{1, 2, 3}, {1, 2, 3}, {1, 2, 3}}, {{0, 1, 2}}, {}};
  const TriangleMesh line{{{0, 0, 0}, {5, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}, {}};
  for (const Camera& wanted : cameras())
    for (const Size size : kSizes) {
      const auto inside = [&](const TriangleMesh& mesh) {
        const Taken part = taken(frame_scene(scene_of(mesh), size.width, size.height, wanted), size, vertices(mesh));
        EXPECT_TRUE(part.left > -0.02 && part.right < 1.02 && part.top > -0.02 && part.bottom < 1.02);
      };
      inside(point);
      inside(line);
    }
}

/// Whatever is asked for, the camera is one: finite, and looking somewhere.
TEST(FrameScene, IsACameraAtEveryExtreme) {
  for (const float coordinate : {0.0F, 1e-40F, 1.0F, 1e18F})
    for (const float fov : {1e-38F, 1e-6F, 3.1415F})
      for (const Size size : {Size{1, 4'000'000'000U}, Size{4'000'000'000U, 1}, Size{1, 1}}) {
        const Scene scene = scene_of(icosphere(0, std::max(coordinate, 1e-40F), {coordinate, coordinate, coordinate}));
        PerspectiveCamera calibrated{kUnplacedView};
        calibrated.intrinsics = Intrinsics{1 / fov, fov, coordinate, -1e30F};
        for (const Camera& wanted : {Camera{PerspectiveCamera{kUnplacedView, fov}},
                                     Camera{OrthographicCamera{kUnplacedView}}, Camera{calibrated}}) {
          const Camera camera = frame_scene(scene, size.width, size.height, wanted);
          const View& view = std::visit([](const auto& c) -> const View& { return c.view; }, camera);
          EXPECT_TRUE(is_finite(view.from) && is_finite(view.at) && view.from != view.at);
          const auto* parallel = std::get_if<OrthographicCamera>(&camera);
          EXPECT_TRUE(!parallel || (parallel->height > 0 && std::isfinite(parallel->height)));
        }
      }
}

}  // namespace
}  // namespace tessera

#include "core/screen/camera_rays.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/sampling/sampler.h"
#include "tests/support/camera_samples.h"

namespace tessera {
namespace {

constexpr std::uint32_t kFilmSide = 100;
constexpr float kRightAngle = std::numbers::pi_v<float> / 2;

CameraRays down_z(Lens lens, std::uint32_t side = kFilmSide) {
  PerspectiveCamera camera{{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}}, kRightAngle};
  camera.lens = lens;
  return {camera, side, side};
}

void expect_near(Vec3d a, Vec3d b, double off) { EXPECT_LT(max_component(abs(a - b)), off) << a.x << " " << a.y; }

TEST(CameraRays, GoThroughTheMiddleAndTheEdges) {
  const CameraRays camera = down_z({});
  EXPECT_EQ(camera.ray(50, 50).direction, (Vec3{0, 0, -1}));
  EXPECT_NEAR(camera.ray(100, 50).direction.x, 1, 1e-6);
  EXPECT_NEAR(camera.ray(50, 0).direction.y, 1, 1e-6) << "row 0 is the top";
  const CameraRays wide(PerspectiveCamera{{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}}, kRightAngle}, 200, 100);
  EXPECT_NEAR(wide.ray(200, 50).direction.x, 2, 1e-6) << "the field of view is vertical";
  const CameraRays parallel(OrthographicCamera{{{1, 2, 3}, {1, 2, 0}, {0, 1, 0}}, 4}, kFilmSide, kFilmSide);
  EXPECT_EQ(parallel.ray(0, 0).origin, (Vec3{-1, 4, 3}));
  EXPECT_EQ(parallel.ray(0, 0).direction, (Vec3{0, 0, -1}));
}

TEST(CameraRays, ProjectWhatTheyPassThrough) {
  const CameraRays camera(PerspectiveCamera{{{1, 2, 3}, {-4, 1, 0}, {0, 1, 0.3F}}, 0.8F}, 640, 480);
  const Ray ray = camera.ray(123.25, 400.5);
  const auto seen = camera.project(to_double(ray.origin) + to_double(ray.direction) * 7.0);
  EXPECT_NEAR(seen.x, 123.25, 1e-3);
  EXPECT_NEAR(seen.y, 400.5, 1e-3);
  EXPECT_NEAR(seen.depth, 7, 1e-5) << "t is depth";
}

/// By hand: what is 0.3 to the right of the axis, 0.2 below it and 2 ahead is seen at x = fx · 0.3 / 2 + cx and
/// y = fy · 0.2 / 2 + cy.
TEST(CameraRays, FollowIntrinsics) {
  PerspectiveCamera camera{{{1, 2, 3}, {1, 2, 0}, {0, 1, 0}}};
  camera.intrinsics = Intrinsics{500, 400, 300, 100};
  const CameraRays rays(camera, 640, 480);
  const auto seen = rays.project({1.3, 1.8, 1});
  EXPECT_NEAR(seen.x, 375, 1e-9);
  EXPECT_NEAR(seen.y, 140, 1e-9);
  EXPECT_NEAR(seen.depth, 2, 1e-12);
  const Ray ray = rays.ray(375, 140);
  EXPECT_EQ(ray.origin, (Vec3{1, 2, 3}));
  expect_near(to_double(ray.direction), {0.15, -0.1, -1}, 1e-7);
  EXPECT_EQ(rays.ray(300, 100).direction, (Vec3{0, 0, -1})) << "the axis";

  camera.intrinsics = Intrinsics{500, 500, -2000, 5000};
  const CameraRays aside(camera, 640, 480);
  expect_near(to_double(aside.ray(0, 0).direction), {4, 10, -1}, 1e-6);
}

TEST(CameraRays, OfAFieldOfViewHaveItsIntrinsics) {
  PerspectiveCamera camera{{{1, 2, 3}, {-4, 1, 0}, {0, 1, 0.3F}}, kRightAngle};
  const CameraRays by_angle(camera, 640, 480);
  camera.intrinsics = Intrinsics{240, 240, 320, 240};  // 480 / 2 / tan 45°
  camera.vertical_fov = 0.1F;                          // without a say
  const CameraRays by_focus(camera, 640, 480);
  for (const double x : {0.0, 123.5, 640.0})
    for (const double y : {0.0, 77.25, 480.0})
      expect_near(to_double(by_angle.ray(x, y).direction), to_double(by_focus.ray(x, y).direction), 1e-6);
}

TEST(CameraRays, EndAtTheClippingPlanes) {
  PerspectiveCamera camera{{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}}};
  camera.clipping = {0.5F, 20};
  OrthographicCamera parallel{{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}}};
  parallel.clipping = {0.5F, 20};
  PerspectiveCamera blurred = camera;
  blurred.lens = {0.1F, 2};
  for (const Camera& c : {Camera(camera), Camera(parallel), Camera(blurred)}) {
    const Ray ray = CameraRays(c, kFilmSide, kFilmSide).ray(3, 4, {0.2F, 0.9F});
    EXPECT_EQ(ray.t_min, 0.5F);
    EXPECT_EQ(ray.t_max, 20);
    EXPECT_NEAR(point_at(ray, ray.t_min).z, -0.5, 1e-6) << "planes across the axis, not spheres";
    EXPECT_NEAR(point_at(ray, ray.t_max).z, -20, 1e-5);
  }
}

/// By hand: from the left end of a lens of radius ½ to what the middle of the image shows 4 ahead.
TEST(CameraRays, OfALensStartOnItAndMeetInFocus) {
  const CameraRays camera = down_z({0.5F, 4});
  const Ray ray = camera.ray(50, 50, {0, 0.5F});
  EXPECT_EQ(ray.origin, (Vec3{-0.5F, 0, 0}));
  EXPECT_EQ(ray.direction, (Vec3{0.125F, 0, -1}));
  const Ray corner = camera.ray(100, 0, {0, 0.5F});
  expect_near(point_at(corner, 4), {4, 4, -4}, 1e-5);
  EXPECT_EQ(camera.ray(20, 30).origin, (Vec3{0, 0, 0})) << "the middle, if nothing is said";
}

TEST(CameraRays, WithoutALensDontAskWhereOnIt) {
  const CameraRays camera = down_z({0, 4});
  EXPECT_FALSE(camera.has_lens());
  EXPECT_EQ(camera.ray(20, 30, {0.1F, 0.7F}).origin, (Vec3{0, 0, 0}));
  EXPECT_EQ(camera.ray(20, 30, {0.1F, 0.7F}).direction, camera.ray(20, 30).direction);
}

/// Wherever the camera is and looks, all rays of an image position pass within 1e-4 pixels of one point in focus.
TEST(CameraRays, AreSharpInFocus_Stress64) {
  double most = 0;
  for (int seed = 0; seed < 400; ++seed) {
    Random random(static_cast<std::uint64_t>(seed));
    const Vec3d eye = random.in_cube() * random.magnitude(-1, 3);
    PerspectiveCamera data{{to_float(eye), to_float(eye + random.direction() * 10.0), to_float(random.direction())},
                           static_cast<float>(random.uniform(0.6, 2))};
    data.lens.focus_distance = static_cast<float>(random.magnitude(-1, 3));
    data.lens.radius = static_cast<float>(data.lens.focus_distance * random.magnitude(-4, 0));
    const CameraRays camera(data, 512, 512);
    const CameraRays pinhole(PerspectiveCamera{data.view, data.vertical_fov}, 512, 512);
    for (int i = 0; i < 100; ++i) {
      const double x = random.uniform(0, 512), y = random.uniform(0, 512);
      const Ray ray = camera.ray(x, y, uniform_pair(random));
      const auto seen = pinhole.project(point_at(ray, data.lens.focus_distance));
      most = std::max({most, std::abs(seen.x - x), std::abs(seen.y - y)});
    }
  }
  EXPECT_LT(most, 1e-4);
}

/// The edge of the lens, in order.
std::vector<Vec2> around_the_lens() {
  constexpr int kSteps = 1000;
  std::vector<Vec2> edge;
  for (int side = 0; side < 4; ++side)
    for (int i = 0; i < kSteps; ++i) {
      const float along = static_cast<float>(i) / kSteps, back = 1 - along;
      edge.push_back(side == 0   ? Vec2{along, 0}
                     : side == 1 ? Vec2{1, along}
                     : side == 2 ? Vec2{back, 1}
                                 : Vec2{0, back});
    }
  return edge;
}

/// Similar triangles: at depth z a lens of radius r is a circle of radius r · |z − f| / z on the plane in focus, where
/// a pixel is f · 2 · tan(fov / 2) / height wide. Before and behind the plane in focus, on the axis and off it.
TEST(CameraRays, BlurCirclesOfTheClosedFormsArea_Stress64) {
  constexpr float kRadius = 0.2F, kFocus = 5;
  const CameraRays camera = down_z({kRadius, kFocus}, 1000);
  const double pixel = kFocus * 2.0 / 1000;
  for (const double z : {1.0, 2.5, 4.5, 5.5, 10.0, 1000.0})
    for (const Vec3d aside : {Vec3d{0, 0, 0}, Vec3d{0.7, -0.4, 0}}) {
      const Vec3d point = aside * z - Vec3d{0, 0, z};
      std::vector<CameraRays::Projected> circle;
      for (const Vec2 lens : around_the_lens()) circle.push_back(seen_through(camera, point, lens));
      double area = 0;
      for (std::size_t i = 0; i < circle.size(); ++i) {
        const auto &a = circle[i], &b = circle[(i + 1) % circle.size()];
        area += 0.5 * (a.x * b.y - b.x * a.y);
      }
      const double radius = kRadius * std::abs(z - kFocus) / z / pixel;
      EXPECT_NEAR(std::abs(area) / (std::numbers::pi * radius * radius), 1, 0.01) << z;
    }
}

/// The samples that meet a small ball out of focus, as many as a film gathers: spread over the circle as over a disk,
/// whose variance along each axis is a quarter of the radius squared.
TEST(CameraRays, SpreadSamplesOverTheCircleOfConfusion_Stress64) {
  constexpr float kFocus = 2;
  constexpr std::uint32_t kSamples = 1024;
  constexpr std::int32_t kPixels = 40;
  constexpr double kDepth = 4, kSeenBall = 0.4;
  const CameraRays camera = down_z({0.8F, kFocus}, kPixels);
  const double pixel = 2.0 / kPixels;  // at depth 1
  const Sampler sampler({.samples = kSamples});
  double hits = 0, sum_x = 0, sum_y = 0, squares = 0;
  for (std::int32_t y = 0; y < kPixels; ++y)
    for (std::int32_t x = 0; x < kPixels; ++x)
      for (std::uint32_t i = 0; i < kSamples; ++i) {
        const SampleId id{x, y, i};
        const PixelOffset offset = sampler.film(id);
        const Vec3d p = point_at(camera.ray(x + offset.x, y + offset.y, sampler.two(id, kLensDimension)), kDepth);
        if (p.x * p.x + p.y * p.y > kSeenBall * kSeenBall) continue;
        const double from_x = x + offset.x - kPixels / 2.0, from_y = y + offset.y - kPixels / 2.0;
        ++hits;
        sum_x += from_x;
        sum_y += from_y;
        squares += from_x * from_x + from_y * from_y;
      }
  const double circle = 0.8 * std::abs(1 / 2.0 - 1 / kDepth) / pixel, disk = kSeenBall / kDepth / pixel;
  EXPECT_NEAR(hits / (std::numbers::pi * disk * disk * kSamples), 1, 0.02) << "light is spread, not lost";
  EXPECT_NEAR(sum_x / hits, 0, 0.06);
  EXPECT_NEAR(sum_y / hits, 0, 0.06);
  EXPECT_NEAR(squares / hits / ((circle * circle + disk * disk) / 2), 1, 0.01);
}

}  // namespace
}  // namespace tessera

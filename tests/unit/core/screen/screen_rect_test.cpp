#include "core/screen/screen_rect.h"

#include <gtest/gtest.h>

#include "core/bounds/cull_ray.h"
#include "tests/support/random.h"

namespace tessera {
namespace {

constexpr std::uint32_t kScreenSide = 100;
constexpr PixelRect kScreen{0, 0, 100, 100};

CameraRays camera_down_z(float fov = 1.0F) {
  return {PerspectiveCamera{{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}}, fov}, kScreenSide, kScreenSide};
}

Aabb around(Vec3 center, float half) { return {center - Vec3{half, half, half}, center + Vec3{half, half, half}}; }

TEST(CameraRays, GoThroughTheMiddleAndTheEdges) {
  const CameraRays camera = camera_down_z(2 * std::atan(1.0F));  // tan(fov / 2) = 1
  EXPECT_EQ(camera.ray(50, 50).direction, (Vec3{0, 0, -1}));
  EXPECT_NEAR(camera.ray(100, 50).direction.x, 1, 1e-6);
  EXPECT_NEAR(camera.ray(50, 0).direction.y, 1, 1e-6) << "row 0 is the top";
  const CameraRays wide(PerspectiveCamera{{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}}, 2 * std::atan(1.0F)}, 200, 100);
  EXPECT_NEAR(wide.ray(200, 50).direction.x, 2, 1e-6) << "the field of view is vertical";
  const CameraRays parallel(OrthographicCamera{{{1, 2, 3}, {1, 2, 0}, {0, 1, 0}}, 4}, kScreenSide, kScreenSide);
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

TEST(ScreenRect, BoundsWhatIsInFront) {
  const CameraRays camera = camera_down_z(2 * std::atan(1.0F));
  // Half of 1 at distance 4 on the near face: 50 ± 50 / 4 · 1.
  EXPECT_EQ(screen_rect(around({0, 0, -5}, 1), camera), (PixelRect{37, 37, 63, 63}));
  EXPECT_TRUE(screen_rect(around({20, 0, -5}, 1), camera).empty()) << "beside";
  EXPECT_TRUE(screen_rect({}, camera).empty());
}

TEST(ScreenRect, IsTheWholeScreenFromInside_Stress38) {
  EXPECT_EQ(screen_rect(around({0, 0, 0}, 1), camera_down_z()), kScreen);
  EXPECT_EQ(screen_rect({{0, 0, 0}, {0, 0, 0}}, camera_down_z()), kScreen) << "a point at the eye: nothing is known";
}

TEST(ScreenRect, IsEmptyBehind_Stress40) { EXPECT_TRUE(screen_rect(around({0, 0, 5}, 1), camera_down_z()).empty()); }

TEST(ScreenRect, DoesNotWrapAroundWhenStraddling_Stress39) {
  // To the right of the camera, from behind it to far ahead: seen on the right, out to the edge.
  const PixelRect rect = screen_rect({{1, -0.1F, -50}, {2, 0.1F, 5}}, camera_down_z());
  EXPECT_GT(rect.x0, 50);
  EXPECT_EQ(rect.x1, 100);
  EXPECT_LE(rect.y0, 45);
}

TEST(ScreenRect, OfAParallelCameraIgnoresDepth) {
  const CameraRays camera(OrthographicCamera{{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}}, 10}, kScreenSide, kScreenSide);
  EXPECT_EQ(screen_rect(around({0, 0, -500}, 1), camera), (PixelRect{39, 39, 61, 61}));
  EXPECT_EQ(screen_rect(around({0, 0, 0}, 1), camera), (PixelRect{39, 39, 61, 61})) << "straddling";
  EXPECT_TRUE(screen_rect(around({0, 0, 5}, 1), camera).empty()) << "behind";
}

/// Every sample whose ray enters the box lies in the box's rectangle.
void expect_superset(const Camera& camera_data, Random& random, double size, int seed) {
  const CameraRays camera(camera_data, kScreenSide, kScreenSide);
  const Vec3 a = to_float(random.in_cube() * size);
  const Vec3 extent = to_float((random.in_cube() + Vec3d{1, 1, 1}) * (size * random.magnitude(-6, 0)));
  const Aabb box{a, a + extent};
  const PixelRect rect = screen_rect(box, camera);
  for (int i = 0; i < 300; ++i) {
    // Aim at pixels about the box, where the answer is hard.
    Vec3d p;
    for (int axis = 0; axis < 3; ++axis) p[axis] = random.uniform(box.lo[axis], box.hi[axis]);
    const auto seen = camera.project(p);
    double x = seen.x, y = seen.y;
    if (!(x >= 0 && x < kScreenSide && y >= 0 && y < kScreenSide))
      x = random.uniform(0, kScreenSide), y = random.uniform(0, kScreenSide);
    const Ray ray = camera.ray(x, y);
    // The unpadded test, in double.
    double lo = 0, hi = 1e300;
    for (int axis = 0; axis < 3; ++axis) {
      const double d = ray.direction[axis], o = ray.origin[axis];
      if (d == 0) {
        if (o < box.lo[axis] || o > box.hi[axis]) lo = 1, hi = 0;
        continue;
      }
      const double t0 = (box.lo[axis] - o) / d, t1 = (box.hi[axis] - o) / d;
      lo = std::max(lo, std::min(t0, t1));
      hi = std::min(hi, std::max(t0, t1));
    }
    if (lo > hi || hi <= 0) continue;
    const auto px = static_cast<std::int32_t>(x), py = static_cast<std::int32_t>(y);
    ASSERT_TRUE(px >= rect.x0 && px < rect.x1 && py >= rect.y0 && py < rect.y1)
        << "seed " << seed << " pixel " << px << " " << py << " rect " << rect.x0 << ".." << rect.x1 << " " << rect.y0
        << ".." << rect.y1;
  }
}

TEST(ScreenRect, IsASupersetForEveryCamera_Stress41) {
  for (int seed = 0; seed < 3000; ++seed) {
    Random random(static_cast<std::uint64_t>(seed));
    const double size = random.magnitude(-3, 4);
    const View view{to_float(random.in_cube() * size), to_float(random.in_cube() * size), to_float(random.direction())};
    const double degrees = seed % 3 == 0 ? random.magnitude(-3, 0) : seed % 3 == 1 ? random.uniform(20, 120) : 179.9;
    expect_superset(PerspectiveCamera{view, static_cast<float>(degrees / 57.29577951308232)}, random, size, seed);
    expect_superset(OrthographicCamera{view, static_cast<float>(size * random.magnitude(-3, 1))}, random, size, seed);
  }
}

}  // namespace
}  // namespace tessera

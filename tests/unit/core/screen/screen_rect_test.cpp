#include "core/screen/screen_rect.h"

#include <gtest/gtest.h>

#include "tests/support/camera_samples.h"

namespace tessera {
namespace {

constexpr std::uint32_t kScreenSide = 100;
constexpr PixelRect kScreen{0, 0, 100, 100};

CameraRays camera_down_z(float fov = 1.0F) {
  return {PerspectiveCamera{{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}}, fov}, kScreenSide, kScreenSide};
}

Aabb around(Vec3 center, float half) { return {center - Vec3{half, half, half}, center + Vec3{half, half, half}}; }

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

/// Whether the ray enters the box: the unpadded test, in double.
bool goes_through(const Ray& ray, const Aabb& box) {
  double lo = 0, hi = 1e300;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = ray.direction[axis], o = ray.origin[axis];
    if (d == 0) {
      if (o < box.lo[axis] || o > box.hi[axis]) return false;
      continue;
    }
    const double t0 = (box.lo[axis] - o) / d, t1 = (box.hi[axis] - o) / d;
    lo = std::max(lo, std::min(t0, t1));
    hi = std::min(hi, std::max(t0, t1));
  }
  return lo <= hi && hi > 0;
}

/// Every sample whose ray enters the box lies in the box's rectangle; returns how many do. They are aimed
/// at the box, where the answer is hard.
int expect_superset(const CameraRays& camera, const Aabb& box, Random& random, int seed) {
  const PixelRect rect = screen_rect(box, camera);
  int entering = 0;
  for (int i = 0; i < 100; ++i) {
    Vec3d p = to_double(box.lo);  // which narrow views look at
    for (int axis = 0; axis < 3 && i % 2 == 0; ++axis)
      p[axis] = random.bits() % 2 == 0 ? box.hi[axis] : random.uniform(box.lo[axis], box.hi[axis]);
    const CameraSample sample = sample_toward(camera, p, random);
    if (!goes_through(sample.ray, box)) continue;
    ++entering;
    EXPECT_TRUE(sample.pixel_x >= rect.x0 && sample.pixel_x < rect.x1 && sample.pixel_y >= rect.y0 &&
                sample.pixel_y < rect.y1)
        << "seed " << seed << " pixel " << sample.pixel_x << " " << sample.pixel_y << " rect " << rect.x0 << ".."
        << rect.x1 << " " << rect.y0 << ".." << rect.y1;
  }
  return entering;
}

/// Over the whole lens, and as far as a filter lets samples fall outside their pixels.
TEST(ScreenRect, IsASupersetForEveryCamera_Stress39_Stress41_Stress42_Stress64) {
  int entering = 0;
  for (int seed = 0; seed < 20'000; ++seed) {
    Random random(static_cast<std::uint64_t>(seed));
    const double size = random.magnitude(-3, 4);
    const Vec3 a = to_float(random.in_cube() * size);
    const Vec3 extent = to_float((random.in_cube() + Vec3d{1, 1, 1}) * (size * random.magnitude(-6, 0)));
    const double beyond = seed % 2 == 0 ? 0 : random.uniform(0, 3);
    const CameraRays camera(any_camera(random, size, a, kScreenSide), kScreenSide, kScreenSide, beyond);
    entering += expect_superset(camera, {a, a + extent}, random, seed);
    if (HasFailure()) break;
  }
  EXPECT_GT(entering, 100'000);
}

/// Where pixels are no larger than what floats stray by: of a narrow pinhole's directions; of a lens's places, far from
/// the origin.
TEST(ScreenRect, HoldsRaysThatStray_Stress41_Stress42) {
  int entering = 0;
  for (int seed = 0; seed < 8000; ++seed) {
    Random random(static_cast<std::uint64_t>(seed));
    const bool has_lens = seed % 2 == 0;
    const double fov = has_lens ? 0.02 : 2e-5;
    const Vec3d from = random.in_cube() * (has_lens ? 1e4 : 1.0), ahead = random.direction() * 5.0;
    PerspectiveCamera data{{to_float(from), to_float(from + ahead), to_float(random.direction())},
                           static_cast<float>(fov)};
    if (has_lens) data.lens = {0.01F, 10};
    const CameraRays camera(data, kScreenSide, kScreenSide);
    const Vec3 a = to_float(from + ahead + random.in_cube() * fov);
    const Vec3 extent = to_float((random.in_cube() + Vec3d{1, 1, 1}) * fov);
    entering += expect_superset(camera, {a, a + extent}, random, seed);
    if (HasFailure()) break;
  }
  EXPECT_GT(entering, 50'000);
}

/// Of a lens so far from the origin that floats don't tell its places apart, nothing is known.
TEST(ScreenRect, IsASupersetWhereALensIsFinerThanFloats_Stress42) {
  int entering = 0;
  for (int seed = 0; seed < 1000; ++seed) {
    Random random(static_cast<std::uint64_t>(seed));
    const Vec3d far = random.in_cube() * random.magnitude(5, 8);
    PerspectiveCamera data{{to_float(far), to_float(far + random.direction() * 100.0), to_float(random.direction())},
                           1};
    data.lens = {static_cast<float>(random.magnitude(-2, 1)), static_cast<float>(random.magnitude(-2, 2))};
    const CameraRays camera(data, kScreenSide, kScreenSide);
    const Vec3 a = to_float(far + random.in_cube() * 30.0);
    const Vec3 extent = to_float((random.in_cube() + Vec3d{1, 1, 1}) * random.magnitude(-1, 1.5));
    entering += expect_superset(camera, {a, a + extent}, random, seed);
    if (HasFailure()) break;
  }
  EXPECT_GT(entering, 1000);
}

/// What reaches from behind the lens past it, beside the axis but within the lens, is seen far out on both sides.
TEST(ScreenRect, OfWhatIsBesideTheAxisOfALensReachesBothSides_Stress39_Stress42) {
  PerspectiveCamera data{{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}}, 1};
  data.lens = {1, 4};
  const CameraRays camera(data, kScreenSide, kScreenSide);
  const Aabb box{{0.2F, 0.6F, -5}, {0.4F, 0.7F, 5}};
  int entering = 0;
  Random random(0);
  for (int i = 0; i < 200; ++i) entering += expect_superset(camera, box, random, i);
  for (int i = 0; i < 10'000; ++i) {
    const Vec3d near{random.uniform(0.2, 0.4), random.uniform(0.6, 0.7), -random.magnitude(-3, 0)};
    const CameraSample sample = sample_toward(camera, near, random);
    const PixelRect rect = screen_rect(box, camera);
    if (!goes_through(sample.ray, box)) continue;
    ++entering;
    ASSERT_TRUE(sample.pixel_x >= rect.x0 && sample.pixel_x < rect.x1);
    ASSERT_TRUE(sample.pixel_y >= rect.y0 && sample.pixel_y < rect.y1);
  }
  EXPECT_GT(entering, 1000);
}

/// By hand: a point 2 ahead, in focus at 4, is seen from a lens of radius ½ up to ½ · (1/2 − 1/4) aside at depth 1,
/// where a pixel is 1/50.
TEST(ScreenRect, GrowsByTheBlurOfALens) {
  PerspectiveCamera data{{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}}, 2 * std::atan(1.0F)};
  data.lens = {0.5F, 4};
  const CameraRays camera(data, kScreenSide, kScreenSide);
  const Vec3 p{0.01F, 0.01F, -2};
  EXPECT_EQ(screen_rect({p, p}, camera), (PixelRect{43, 43, 57, 57}));
  const Vec3 in_focus{0.02F, 0.02F, -4};
  EXPECT_EQ(screen_rect({in_focus, in_focus}, camera), (PixelRect{50, 49, 51, 50}));
}

TEST(ScreenRect, GrowsByTheReachOfAFilter) {
  const Camera data = PerspectiveCamera{{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}}, 2 * std::atan(1.0F)};
  const Vec3 p{0.01F, -0.01F, -1};  // at 50.5, 50.5
  EXPECT_EQ(screen_rect({p, p}, {data, kScreenSide, kScreenSide}), (PixelRect{50, 50, 51, 51}));
  EXPECT_EQ(screen_rect({p, p}, {data, kScreenSide, kScreenSide, 1.25}), (PixelRect{49, 49, 52, 52}));
  const Vec3 beside{-1.03F, 0, -1};  // 1.5 pixels left of the image
  EXPECT_TRUE(screen_rect({beside, beside}, {data, kScreenSide, kScreenSide, 1.25}).empty());
  EXPECT_EQ(screen_rect({beside, beside}, {data, kScreenSide, kScreenSide, 1.75}).x1, 1);
}

}  // namespace
}  // namespace tessera

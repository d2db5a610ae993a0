#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/screen/camera_rays.h"
#include "tests/support/random.h"

namespace tessera {

inline Vec3d point_at(const Ray& ray, double t) { return to_double(ray.origin) + to_double(ray.direction) * t; }

inline Vec2 uniform_pair(Random& random) {
  return {static_cast<float>(random.bits() >> 41) * 0x1p-23F, static_cast<float>(random.bits() >> 41) * 0x1p-23F};
}

/// Where on the image rays through `lens` show a point: a position is moved by what its ray passes the point by.
inline CameraRays::Projected seen_through(const CameraRays& camera, Vec3d point, Vec2 lens) {
  auto seen = camera.project(point);
  const auto goal = camera.sideways(point);
  for (int i = 0; i < 2; ++i) {  // once, but for rounding
    const auto here = camera.sideways(point_at(camera.ray(seen.x, seen.y, lens), seen.depth));
    const auto right = camera.sideways(point_at(camera.ray(seen.x + 1, seen.y, lens), seen.depth));
    const auto below = camera.sideways(point_at(camera.ray(seen.x, seen.y + 1, lens), seen.depth));
    seen.x += (goal.x - here.x) / (right.x - here.x);
    seen.y += (goal.y - here.y) / (below.y - here.y);
  }
  return seen;
}

/// A sample of a pixel of the image, which may fall `CameraRays::beyond` outside of it.
struct CameraSample {
  std::int32_t pixel_x, pixel_y;
  Ray ray;
};

/// One that shows the point or what is a pixel beside it, if any does, or falls anywhere; from anywhere on the lens,
/// its edge as often as not.
inline CameraSample sample_toward(const CameraRays& camera, Vec3d point, Random& random) {
  Vec2 lens = uniform_pair(random);
  if (random.bits() % 2) (random.bits() % 2 ? lens.x : lens.y) = random.bits() % 2 ? 0 : 1;
  auto seen = seen_through(camera, point, lens);
  if (random.bits() % 3 == 0) {
    seen.x += random.uniform(-1, 1);
    seen.y += random.uniform(-1, 1);
  }
  const auto place = [&](double position, double size) {
    const double beyond = camera.beyond();
    const double pixel = std::floor(position + random.uniform(-beyond, beyond));
    if (pixel >= 0 && pixel < size) return std::pair(pixel, position);
    const double any = std::floor(random.uniform(0, size));
    return std::pair(any, any + random.uniform(-beyond, 1 + beyond));
  };
  const auto [px, x] = place(seen.x, camera.width());
  const auto [py, y] = place(seen.y, camera.height());
  return {static_cast<std::int32_t>(px), static_cast<std::int32_t>(py), camera.ray(x, y, lens)};
}

/// Any camera about a scene of that size: from the narrowest view to the widest, with or without a lens, by its field
/// of view or intrinsics, with rays that are parallel or not. A narrow view looks about `target`, or it would see
/// nothing.
inline Camera any_camera(Random& random, double size, Vec3 target, std::uint32_t side) {
  const int kind = static_cast<int>(random.bits() % 8);
  const bool narrow = kind < 3;
  const double degrees = narrow ? random.magnitude(-3, 0) : kind < 5 ? random.uniform(20, 120) : 179.9;
  const double fov = degrees / 180 * std::numbers::pi;
  const Vec3d from = random.in_cube() * size, up = random.direction();
  Vec3d at = random.in_cube() * size;
  if (narrow) at = to_double(target) + at * (0.3 * fov);  // anywhere in the image
  const View view{to_float(from), to_float(at), to_float(up)};
  if (kind >= 6) return OrthographicCamera{view, static_cast<float>(size * random.magnitude(-3, 1))};
  PerspectiveCamera camera{view, static_cast<float>(fov)};
  if (random.bits() % 3 == 0) {
    const double focal = side / 2.0 / std::tan(camera.vertical_fov / 2.0);
    camera.intrinsics =
        Intrinsics{static_cast<float>(focal), static_cast<float>(focal * random.magnitude(-1, 1)),
                   static_cast<float>(side * random.uniform(-1, 2)), static_cast<float>(side * random.uniform(-1, 2))};
  }
  if (random.bits() % 4 != 0)
    camera.lens = {static_cast<float>(size * random.magnitude(-5, 0.5)),
                   static_cast<float>(size * random.magnitude(-3, 1.5))};
  return camera;
}

}  // namespace tessera

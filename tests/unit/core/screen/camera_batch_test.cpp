#include "core/screen/camera_batch.h"

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace tessera {
namespace {

constexpr std::uint32_t kImageSide = 64;

struct Point {
  double x, y;
};

std::vector<Point> anywhere() {
  Random random(1);
  std::vector<Point> points(300);
  for (Point& p : points) p = {random.uniform(0, kImageSide), random.uniform(0, kImageSide)};
  return points;
}

bool are_same(const Ray& a, const Ray& b) {
  return a.origin == b.origin && a.direction == b.direction && a.t_min == b.t_min && a.t_max == b.t_max;
}

/// Whatever the form, rays and hits are those of the camera's rays one by one.
TEST(CameraBatch, IsTheCamerasRays) {
  const auto scene = mixed_scene();
  for (const Camera& camera : {mixed_camera(), orthographic_camera()}) {
    const CameraRays rays(camera, kImageSide, kImageSide);
    CameraBatch batch(rays);
    for (const AccelKind kind : {AccelKind::brute, AccelKind::wide}) {
      const auto accel = make_accel(scene, {kind});
      batch.clear();
      EXPECT_EQ(batch.size(), 0U) << "memory is kept, rays aren't";
      const std::vector<Point> points = anywhere();
      for (const Point& p : points) batch.add(p.x, p.y);
      ASSERT_EQ(batch.size(), points.size());
      std::vector<Hit> hits(points.size());
      batch.closest(*accel, hits, {}, {});
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Ray alone = rays.ray(points[i].x, points[i].y);
        EXPECT_TRUE(are_same(batch.rays()[i], alone));
        EXPECT_EQ(hits[i], accel->closest(alone).value_or(Hit{}));
      }
    }
  }
}

}  // namespace
}  // namespace tessera

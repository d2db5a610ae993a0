#include "core/screen/camera_batch.h"

#include <gtest/gtest.h>

#include "tests/support/camera_samples.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

constexpr std::uint32_t kImageSide = 64;

struct Place {
  double x, y;
  Vec2 lens;
};

std::vector<Place> anywhere() {
  Random random(1);
  std::vector<Place> places(60);
  for (Place& p : places) p = {random.uniform(0, kImageSide), random.uniform(0, kImageSide), uniform_pair(random)};
  return places;
}

/// With and without a lens, and with clipping planes that pass through the scene.
std::vector<Camera> lensed_and_clipped() {
  auto clipped = std::get<PerspectiveCamera>(mixed_camera());
  clipped.clipping = {4, 6};
  auto far_sighted = clipped, short_sighted = clipped, empty = clipped;
  far_sighted.clipping = {7, kInfinity};
  short_sighted.clipping = {0, 5};
  empty.clipping = {5, 5};
  auto lensed = std::get<PerspectiveCamera>(mixed_camera());
  lensed.lens = {0.3F, 5};
  auto both = lensed;
  both.clipping = clipped.clipping;
  auto parallel = std::get<OrthographicCamera>(orthographic_camera());
  parallel.clipping = {4, 6};
  return {mixed_camera(), orthographic_camera(), clipped, far_sighted, short_sighted, empty, lensed, both, parallel};
}

/// A lone mesh, which structures may treat in a way of their own.
std::shared_ptr<const Scene> lone_mesh() { return SceneBuilder().add(icosphere(2, 1.5F)).build(); }

bool are_same(const Ray& a, const Ray& b) {
  return a.origin == b.origin && a.direction == b.direction && a.t_min == b.t_min && a.t_max == b.t_max;
}

/// Whatever the form, rays and hits are those of the camera's rays one by one.
TEST(CameraBatch, IsTheCamerasRays) {
  const std::vector<Place> places = anywhere();
  for (const auto& scene : {mixed_scene(), lone_mesh()}) {
    const auto brute = make_accel(scene, {AccelKind::brute}), wide = make_accel(scene, {AccelKind::wide});
    int hit = 0, missed = 0;
    for (const Camera& camera : lensed_and_clipped()) {
      const CameraRays rays(camera, kImageSide, kImageSide);
      CameraBatch batch(rays);
      for (const Accel* accel : {brute.get(), wide.get()}) {
        batch.clear();
        EXPECT_EQ(batch.size(), 0U) << "memory is kept, rays aren't";
        for (const Place& p : places) batch.add(p.x, p.y, p.lens);
        ASSERT_EQ(batch.size(), places.size());
        std::vector<Hit> hits(places.size());
        batch.closest(*accel, hits, {}, {});
        for (std::size_t i = 0; i < places.size(); ++i) {
          const Ray alone = rays.ray(places[i].x, places[i].y, places[i].lens);
          EXPECT_TRUE(are_same(batch.rays()[i], alone));
          ASSERT_EQ(hits[i], brute->closest(alone).value_or(Hit{}));
          ++(hits[i].t < kInfinity ? hit : missed);
        }
      }
    }
    EXPECT_GT(hit, 100);
    EXPECT_GT(missed, 100);
  }
}

}  // namespace
}  // namespace tessera

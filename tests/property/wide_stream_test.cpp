// Rays that the wide structure takes through a tree together: more than a stream of them holds; through many objects.
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/accel/make.h"
#include "core/accel/test_counts.h"
#include "core/accel/wide/wide_accel.h"
#include "core/accel/wide/wide_build.h"
#include "core/accel/wide/wide_kernels.h"
#include "core/math/ray_fan.h"
#include "tests/property/closed_meshes.h"
#include "tests/support/random.h"
#include "tests/support/same_hits.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

/// Twice what a stream holds, and some: each of its rays answers for itself, and none for another's.
TEST(WideKernels, AgreeOnMoreRaysThanAStreamHolds) {
  const TriangleMesh mesh = icosphere(4);
  const auto brute = make_accel(SceneBuilder().add(mesh).build(), {AccelKind::brute});
  const WideTree tree = build_wide(mesh);
  Random random(1);
  std::vector<Ray> some(300);
  std::vector<Hit> expected;
  for (Ray& ray : some) {
    ray.origin = to_float(random.in_cube() * 1.5);
    ray.direction = to_float(random.direction());
    expected.push_back(brute->closest(ray).value_or(Hit{}));
  }
  std::vector<Ray> rays(2 * kStreamRays + 4464);
  const auto which = [&](std::size_t i) { return (i + i / some.size() * 7) % some.size(); };
  for (std::size_t i = 0; i < rays.size(); ++i) rays[i] = some[which(i)];
  for (const WideKernels* kernels : runnable_wide_kernels()) {
    std::vector<Hit> hits(rays.size());
    kernels->closest(tree, 0, rays, hits, nullptr);
    std::vector<std::uint8_t> hidden(rays.size());
    kernels->occluded(tree, 0, rays, hidden, nullptr);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_EQ(hits[i], expected[which(i)]) << kernels->name << ", ray " << i;
      ASSERT_EQ(hidden[i], expected[which(i)].t < kInfinity) << kernels->name << ", ray " << i;
    }
  }
}

/// Far more objects than are asked one by one: of every kind, a third of them placed, some of them twice.
constexpr int kObjects = 400;
constexpr std::size_t kRays = 1500;

std::vector<Ray> rays_through_many() {
  Random random(3);
  std::vector<Ray> rays(kRays);
  for (Ray& ray : rays) {
    ray.origin = to_float(random.in_cube() * 15);
    ray.direction = to_float(random.direction());
    if (random.bits() % 3 == 0) ray.t_max = static_cast<float>(random.uniform(0, 5));
  }
  return rays;
}

template <typename Check>
void for_each_kernels(const std::shared_ptr<const Scene>& scene, Check&& check) {
  for (const WideKernels* kernels : runnable_wide_kernels())
    check(*make_wide(scene, {AccelKind::wide}, *kernels, WideAccel::build_tree), std::string(kernels->name));
}

TEST(WideAccelManyBodies, RaysTogetherFindWhatBruteForceFinds) {
  const auto scene = random_scene(11, kObjects);
  const std::vector<Ray> rays = rays_through_many();
  const auto known = known_rays(scene, rays);
  ASSERT_GT(count_hits(known), kRays / 4);
  ASSERT_LT(count_hits(known), kRays * 9 / 10);
  for_each_kernels(scene, [&](const Accel& accel, const std::string& name) {
    TestCounts counts;
    for (TestCounts* counted : {static_cast<TestCounts*>(nullptr), &counts}) {
      std::vector<Hit> hits(kRays);
      std::vector<std::uint8_t> hidden(kRays);
      accel.closest(rays, hits, {nullptr, counted}, std::nullopt);
      accel.occluded(rays, hidden, {nullptr, counted});
      for (std::size_t i = 0; i < kRays; ++i) {
        ASSERT_EQ(hits[i], known[i].hit.value_or(Hit{})) << name << ", ray " << i;
        ASSERT_EQ(hidden[i] != 0, known[i].hit.has_value()) << name << ", ray " << i;
      }
    }
    EXPECT_GT(counts.volume_tests, 0U) << name;
    EXPECT_GT(counts.object_tests, 0U) << name;
  });
}

TEST(WideAccelManyBodies, FansFindWhatTheirRaysFind) {
  const auto scene = random_scene(12, kObjects);
  Random random(4);
  const Vec3 origin{14, 1, 2};
  Directions directions;
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < kRays; ++i) {
    directions.push_back(to_float(random.in_cube() * 6) - origin);
    rays.push_back({origin, {directions.x[i], directions.y[i], directions.z[i]}});
  }
  const auto known = known_rays(scene, rays);
  ASSERT_GT(count_hits(known), kRays / 4);
  for_each_kernels(scene, [&](const Accel& accel, const std::string& name) {
    std::vector<Hit> hits(kRays);
    accel.closest_fan(RayFan(origin, directions), hits, {}, std::nullopt);
    for (std::size_t i = 0; i < kRays; ++i) ASSERT_EQ(hits[i], known[i].hit.value_or(Hit{})) << name << ", ray " << i;
  });
}

TEST(WideAccelManyBodies, RaysToAPointAreHiddenAsEachIsAlone) {
  const auto scene = random_scene(13, kObjects);
  Random random(5);
  const Vec3 apex{3, 14, -2};
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < kRays; ++i) {
    const Vec3 from = to_float(random.in_cube() * 9);
    rays.push_back({from, apex - from, 1e-3F, 1});
  }
  const auto known = known_rays(scene, rays);
  ASSERT_GT(count_hits(known), kRays / 4);
  ASSERT_LT(count_hits(known), kRays);
  for_each_kernels(scene, [&](const Accel& accel, const std::string& name) {
    std::vector<std::uint8_t> hidden(kRays);
    accel.occluded_fan(apex, rays, hidden, {});
    for (std::size_t i = 0; i < kRays; ++i)
      ASSERT_EQ(hidden[i] != 0, known[i].hit.has_value()) << name << ", ray " << i;
  });
}

}  // namespace
}  // namespace tessera

// Laws L1 and L2: every structure gives the hits of brute force, to the bit.
#include <numeric>

#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/moved_scene.h"
#include "tests/support/same_hits.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

/// Rays of every kind that gives structures trouble.
Ray random_ray(Random& random, double size) {
  const auto point = [&] { return to_float(random.in_cube() * size * random.magnitude(-1, 1)); };
  Ray ray{point(), {}};
  switch (random.bits() % 5) {
    case 0:
      ray.direction = to_float(random.direction());
      break;
    case 1:
      ray.direction = point() - ray.origin;
      break;
    case 2:
      ray.direction[static_cast<int>(random.bits() % 3)] = random.bits() % 2 ? 1.0F : -1.0F;
      break;
    case 3: {  // two components, one of them hardly there
      const auto axis = static_cast<int>(random.bits() % 3);
      ray.direction[axis] = 1;
      ray.direction[(axis + 1) % 3] = static_cast<float>(random.magnitude(-44, 0));
      break;
    }
    default:
      ray.direction = to_float(random.direction() * random.magnitude(-20, 20));
      break;
  }
  if (random.bits() % 4 == 0) ray.t_max = static_cast<float>(random.magnitude(-2, 2));
  if (random.bits() % 4 == 0) ray.t_min = static_cast<float>(random.magnitude(-2, 1));
  return ray;
}

std::vector<Ray> random_rays(std::uint64_t seed, double size, int count) {
  Random random(seed);
  std::vector<Ray> rays;
  for (int i = 0; i < count; ++i) rays.push_back(random_ray(random, size));
  return rays;
}

void expect_agreement(const std::shared_ptr<const Scene>& scene, const std::vector<Ray>& rays, std::uint64_t seed,
                      const std::vector<AccelOptions>& choices = accel_choices()) {
  const auto known = known_rays(scene, rays);
  EXPECT_EQ(count_hits(known) > 0, !scene->objects.empty()) << "scene " << seed;
  std::vector<std::uint32_t> all(scene->objects.size());
  std::iota(all.begin(), all.end(), 0U);
  for (const AccelOptions& options : choices) {
    const auto accel = make_accel(scene, options);
    const std::string what = describe(options) + ", scene " + std::to_string(seed);
    expect_same_hits(*accel, known, what);
    for (const auto& [ray, hit] : known) ASSERT_EQ(accel->closest_among(ray, all), hit) << what;
  }
}

TEST(Structures, AgreeOnRandomScenes_Stress54) {
  const auto scenes = static_cast<std::uint64_t>(effort(8, 100));
  for (std::uint64_t seed = 0; seed < scenes; ++seed)
    expect_agreement(random_scene(seed, 60), random_rays(seed, 10, 1000), seed);
}

TEST(Structures, AgreeWithEveryNumberAtItsLeastAndItsMost) {
  const auto scenes = static_cast<std::uint64_t>(effort(3, 30));
  for (std::uint64_t seed = 0; seed < scenes; ++seed)
    expect_agreement(random_scene(seed, 150), random_rays(seed, 10, 300), seed, accel_extremes());
}

TEST(Structures, AgreeOnTinyAndHugeScenes) {
  const auto scenes = static_cast<std::uint64_t>(effort(4, 50));
  for (std::uint64_t seed = 0; seed < scenes; ++seed)
    for (const double size : {1e-6, 1e6})
      expect_agreement(random_scene(seed, 40, size), random_rays(seed, size, 500), seed);
}

/// 10⁸ away floats are 8 apart, in scenes of size 10.
TEST(Structures, AgreeOnFarScenes) {
  const auto scenes = static_cast<std::uint64_t>(effort(8, 100));
  for (std::uint64_t seed = 0; seed < scenes; ++seed) {
    Random random(seed);
    const Vec3d offset = std::pow(10.0, 5 + static_cast<double>(seed % 4)) * random.direction();
    std::vector<Ray> rays = random_rays(seed, 10, 500);
    for (Ray& ray : rays) move(ray.origin, offset);
    expect_agreement(moved(*random_scene(seed, 40), offset), rays, seed);
  }
}

TEST(Structures, AgreeOnOneTwoThreePrimitivesAndNone_Stress51) {
  for (int count = 0; count <= 3; ++count) expect_agreement(random_scene(100, count), random_rays(100, 10, 500), 100);
}

TEST(Structures, MarkTheObjectsThatAreTested) {
  const auto scene =
      SceneBuilder().add(Sphere{{0, 0, 0}, 1}).add(Sphere{{0, 0, 50}, 1}).add(Sphere{{9, 9, 9}, 1}).build();
  for (const AccelEntry& row : accel_table()) {
    AccelOptions options{row.kind};
    options.leaf_size = 1;
    const auto accel = make_accel(scene, options);
    ObjectMarks tested(3);
    EXPECT_EQ(tested.unmarked(), 3U);
    EXPECT_TRUE(accel->occluded({{0, 0, -5}, {0, 0, 1}, 0, 10}, {&tested}));
    EXPECT_TRUE(accel->closest({{0, 0, -5}, {0, 0, 1}}, {&tested}));
    EXPECT_EQ(tested.unmarked(), row.builds ? 2U : 0U) << row.name;
  }
}

TEST(Structures, TakeTheIntervalAsOpen_Stress08) {
  const auto scene = SceneBuilder().add(Quad{{{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}}}).build();
  for (const AccelOptions& options : accel_choices()) {
    const auto accel = make_accel(scene, options);
    const auto hits = [&](float lo, float hi) { return accel->closest({{0, 0, 2}, {0, 0, -1}, lo, hi}).has_value(); };
    EXPECT_TRUE(hits(0, 3)) << describe(options);
    EXPECT_FALSE(hits(0, 2)) << describe(options) << ": t = t_max is outside";
    EXPECT_FALSE(hits(2, 3)) << describe(options) << ": t = t_min is outside";
    EXPECT_TRUE(hits(std::nextafter(2.0F, 0.0F), std::nextafter(2.0F, 3.0F))) << describe(options);
  }
}

}  // namespace
}  // namespace tessera

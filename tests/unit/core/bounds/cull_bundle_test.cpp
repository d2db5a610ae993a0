#include "core/bounds/cull_bundle.h"

#include <vector>

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

Vec3 near(Vec3 middle, double by, Random& random) { return to_float(to_double(middle) + random.in_cube() * by); }

/// Law L2: whatever one of the rays may hit alone, it may hit among others.
TEST(CullBundle, TurnsAwayNoMoreThanEachRayAlone) {
  int turned_away = 0, not_turned_away = 0;
  for (std::uint64_t seed = 0; seed < 20'000; ++seed) {
    Random random(seed);
    const double size = random.magnitude(-6, 6), spread = random.magnitude(-7, 0.3);
    const Vec3 origin = to_float(random.in_cube() * size), target = to_float(random.in_cube() * size);
    std::vector<Ray> rays;
    for (std::size_t i = 1 + random.bits() % 16; i-- > 0;) {
      Ray ray{near(origin, size * spread, random), near(target - origin, size * spread, random)};
      // Some run along axes, or hardly along others.
      if (random.bits() % 4 == 0)
        ray.direction[static_cast<int>(random.bits() % 3)] = random.bits() % 2 ? 0.0F : 1e-38F;
      if (max_component(abs(ray.direction)) == 0) ray.direction.z = 1;
      ray.t_min = static_cast<float>(random.uniform(-0.5, 0.5));
      ray.t_max = static_cast<float>(random.uniform(0.6, 3));
      rays.push_back(ray);
    }
    const Aabb reach{{static_cast<float>(-2 * size), static_cast<float>(-2 * size), static_cast<float>(-2 * size)},
                     {static_cast<float>(2 * size), static_cast<float>(2 * size), static_cast<float>(2 * size)}};
    const CullBundle bundle(rays, reach, {});
    for (int k = 0; k < 8; ++k) {
      Aabb box;
      box.extend(to_float(random.in_cube() * size));
      box.extend(near(box.lo, size * random.magnitude(-6, 0), random));
      // Often with a side exactly on a ray.
      const Ray& ray = rays[random.bits() % rays.size()];
      if (random.bits() % 2) box.extend(ray.origin + ray.direction * static_cast<float>(random.uniform(0, 1.2)));
      const float limit = random.bits() % 3 ? kInfinity : static_cast<float>(random.uniform(0, 2));
      const bool misses = bundle.misses(box, limit);
      (misses ? turned_away : not_turned_away) += 1;
      if (!misses) continue;
      for (const Ray& one : rays)
        ASSERT_TRUE(CullRay(one, reach).misses(box, one.t_min, std::min(limit, one.t_max))) << "seed " << seed;
    }
  }
  EXPECT_GT(turned_away, 20'000);
  EXPECT_GT(not_turned_away, 20'000);
}

TEST(CullBundle, OfOneRayTurnsAwayWhatItMisses) {
  const Ray ray{{0, 0, 0}, {1, 2, 3}};
  const Aabb reach{{-9, -9, -9}, {9, 9, 9}};
  const CullBundle bundle({&ray, 1}, reach, {});
  EXPECT_FALSE(bundle.misses({{1, 2, 3}, {2, 4, 6}}, kInfinity));
  EXPECT_TRUE(bundle.misses({{1, 2, 3}, {2, 4, 6}}, 0.9F)) << "before the box";
  EXPECT_TRUE(bundle.misses({{1, 3, 3}, {1.1F, 4, 3.1F}}, kInfinity)) << "beside it";
  EXPECT_TRUE(bundle.misses({{-2, -4, -6}, {-1, -2, -3}}, kInfinity)) << "behind the origin";
}

}  // namespace
}  // namespace tessera

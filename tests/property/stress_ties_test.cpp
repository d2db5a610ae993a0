// STRESS 23–26: surfaces on top of each other, and rays that start on them, in every structure × bound × space.
#include <cstdio>

#include <gtest/gtest.h>

#include "core/integrator/spawn.h"
#include "core/light/illuminate.h"
#include "tests/property/stress_scenes.h"
#include "tests/support/effort.h"
#include "tests/support/same_hits.h"

namespace tessera {
namespace {

TEST(StressTies, OfTwinsTheLowestIdentityWins_Stress23) {
  // Pairs of objects, of triangles within a mesh, and of instances, one after the other and far apart in number.
  SceneBuilder b;
  TriangleMesh mesh = grid_plane(6);
  const auto once = mesh.triangles;
  mesh.triangles.insert(mesh.triangles.end(), once.begin(), once.end());
  const auto shape = b.shape(mesh);
  for (int i = 0; i < 2; ++i) {
    b.place(shape).place(shape, 0, placed({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 4}));
    b.add(Sphere{{0, 0, 8}, 1}).add(flat_quad(2, {-1, -1, 12}, 2, 2));
  }
  const auto scene = b.build();
  Random random(23);
  std::vector<KnownRay> known;
  for (int i = 0; i < effort(1500, 50'000); ++i) {
    const Vec3 target = to_float(random.in_cube());
    const std::uint32_t layer = static_cast<std::uint32_t>(random.bits() % 4);
    const Vec3 origin{target.x, target.y, static_cast<float>(layer) * 4 + 2 + 0.5F * target.z};
    known.push_back({{origin, {0, 0, -1}}, {}});
  }
  std::vector<Ray> rays;
  for (const KnownRay& k : known) rays.push_back(k.ray);
  known = known_rays(scene, rays);
  for (const KnownRay& k : known) {
    ASSERT_TRUE(k.hit || k.ray.origin.z > 8);
    if (k.hit) {
      EXPECT_LT(k.hit->object, 4U) << "the first of each pair";
      EXPECT_LT(k.hit->primitive, once.size());
    }
  }
  expect_same_hits_everywhere(scene, known, "pairs");
}

TEST(StressTies, AHundredThousandTwinsStayShallow_Stress23) {
  const auto twins = [](std::size_t count) {
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles.assign(count, {0, 1, 2});
    return SceneBuilder().add(mesh).add(mesh).build();
  };
  const std::vector<KnownRay> known{{{{0.2F, 0.2F, 1}, {0, 0, -1}}, Hit{1, 0, 0}},
                                    {{{0, 0, 2}, {0, 0, -1}}, Hit{2, 0, 0}},
                                    {{{0.6F, 0.6F, 1}, {0, 0, -1}}, {}}};
  for (const AccelOptions& options : accel_choices()) {
    const bool is_default = options == AccelOptions{options.kind};  // other bounds take their time over so many
    const std::size_t count = is_default || long_tests() ? static_cast<std::size_t>(effort(10'000, 100'000)) : 4'000;
    const auto accel = make_accel(twins(count), options);
    EXPECT_LE(accel->stats().depth, 24U) << describe(options) << ": 2^17 > 100,000, and the objects";
    EXPECT_LE(accel->stats().bytes, count * 2 * 200) << describe(options);
    expect_same_hits(*accel, known, describe(options));
  }
}

/// A triangle of any size and place, a sphere or a cylinder.
std::shared_ptr<const Scene> one_primitive(Random& random, int kind) {
  if (kind == 0) {
    TriangleMesh mesh;
    const double size = random.magnitude(-8, 8);
    for (int i = 0; i < 3; ++i) mesh.positions.push_back(to_float(random.in_cube() * size));
    mesh.triangles = {{0, 1, 2}};
    return SceneBuilder().add(mesh).build();
  }
  const Vec3 center = to_float(random.in_cube() * random.magnitude(-8, 8));
  const auto radius = static_cast<float>(random.magnitude(-4, 4));
  if (kind == 1) return SceneBuilder().add(Sphere{center, radius}).build();
  Vec3 apex = center;
  for (double l = radius; apex == center; l *= 2) apex = to_float(to_double(center) + random.direction() * l);
  return SceneBuilder().add(Cylinder{center, apex, radius}).build();
}

/// All are convex, so what leaves on the outer side never comes back. (The primitives alone have many more such rays
/// in quadrics_respawn_test.)
TEST(StressTies, WhatLeavesASurfaceDoesNotHitItAgain_Stress24) {
  int spawned = 0;
  for (int seed = 0; seed < effort(60, 3000); ++seed) {
    Random random(seed);
    const auto scene = one_primitive(random, seed % 3);
    const Aabb box = bounds(scene->shapes[0]);
    const Vec3d middle = to_double(box.center()), half = to_double(box.hi) - middle;
    std::vector<Ray> aimed;
    for (int i = 0; i < effort(30, 1000); ++i) {
      const Vec3d inside = seed % 3 == 0 ? Vec3d{} : random.in_cube();
      const Vec3d target = middle + Vec3d{inside.x * half.x, inside.y * half.y, inside.z * half.z};
      const Vec3 origin = to_float(target + random.direction() * (length(half) * random.magnitude(0, 2)));
      aimed.push_back({origin, to_float(target - to_double(origin))});
    }
    std::vector<KnownRay> again;
    for (const auto& [ray, hit] : known_rays(scene, aimed)) {
      if (!hit) continue;
      const SurfacePoint at = world_surface(*scene, 0, hit->primitive, ray, hit->t);
      Vec3d out = to_double(to_float(random.direction()));
      const double side = dot(out, at.geometric_normal);
      if (side == 0) continue;
      if (side < 0 && seed % 3 != 0) out = -out;
      const Vec3 from = spawn_origin(at, out);
      again.push_back({{from, to_float(out)}, {}});
      const int power = std::ilogb(length(half) * random.magnitude(-2, 6));
      again.push_back({{from, to_float(out) * std::ldexp(1.0F, power), 0, 1}, {}});
    }
    spawned += static_cast<int>(again.size());
    expect_same_hits_everywhere(scene, again, "seed " + std::to_string(seed));
  }
  EXPECT_GT(spawned, effort(60, 3000) * 10);
}

TEST(StressTies, ALightInTheSurfacesPlaneIsNeitherHiddenNorLeaks_Stress25) {
  // A floor of many triangles, a wall on it at x = 2, lights in the floor's plane on either side of the wall.
  TriangleMesh floor = grid_plane(8);
  for (Vec3& p : floor.positions) p = p * 8;
  const auto wall = flat_quad(0, {2, -8, -1}, 16, 2);
  const auto open = SceneBuilder().add(floor).build(), closed = SceneBuilder().add(floor).add(wall).build();
  const auto brute = make_accel(open, {AccelKind::brute});
  Random random(25);
  std::vector<KnownRay> lit;
  for (int i = 0; i < effort(500, 50'000); ++i) {
    const Ray down{to_float(Vec3d{random.uniform(-7, 1), random.uniform(-7, 7), 1}), {0, 0, -1}};
    const auto hit = brute->closest(down);
    ASSERT_TRUE(hit);
    const SurfacePoint at = world_surface(*open, 0, hit->primitive, down, hit->t);
    const PointLight lamp{to_float(Vec3d{random.uniform(2.5, 8), random.uniform(-7, 7), 0}), {1, 1, 1}};
    lit.push_back({shadow_ray(lamp, spawn_origin(at, {0, 0, 1})), {}});
  }
  expect_same_hits_everywhere(open, lit, "no self-shadow");
  for (const AccelOptions& options : accel_choices()) {
    const auto accel = make_accel(closed, options);
    for (const KnownRay& k : lit) ASSERT_TRUE(accel->occluded(k.ray)) << describe(options) << ": no leak";
  }
}

/// The surface that a ray leaves, and another k ulps in front of it: does the ray meet it?
bool meets(const AccelOptions& options, float height, int axis, int k) {
  float above = height;
  for (int i = 0; i < k; ++i) above = std::nextafter(above, kInfinity);
  Vec3 corner{-1, -1, -1};
  SceneBuilder b;
  for (const float h : {height, above}) {
    corner[axis] = h;
    b.add(flat_quad(axis, corner, 2, 2));
  }
  const auto scene = b.build();
  Ray ray{{0.3F, 0.3F, 0.3F}, {}};
  ray.origin[axis] = height - std::max(1.0F, std::abs(height));
  ray.direction[axis] = 1;
  Vec3d up;
  up[axis] = 1;
  const auto hit = make_accel(scene, {AccelKind::brute})->closest(ray);
  if (!hit) return false;
  const SurfacePoint at = world_surface(*scene, 0, 0, ray, hit->t);
  return make_accel(scene, options)->occluded({spawn_origin(at, up), to_float(up)});
}

/// A spawned origin is the first float beyond twice the error of the hit, in float terms one ulp off; a hit needs
/// t > 0 beyond that: two ulps always do, one does not.
TEST(StressTies, SurfacesTwoUlpsApartDoNotLeak_Stress26) {
  int smallest = 0;
  for (const AccelOptions& options : accel_choices())
    for (int seed = 0; seed < effort(60, 2000); ++seed) {
      Random random(seed);
      const auto height = static_cast<float>(random.uniform(-1, 1) * random.magnitude(-6, 6));
      int k = 1;
      while (k < 100 && !meets(options, height, seed % 3, k)) ++k;
      smallest = std::max(smallest, k);
      ASSERT_LE(k, 2) << describe(options) << " at " << height;
    }
  RecordProperty("smallest_k_without_leaks", smallest);
  std::printf("surfaces %d ulps apart don't leak\n", smallest);
}

}  // namespace
}  // namespace tessera

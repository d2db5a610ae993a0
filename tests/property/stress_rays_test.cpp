// STRESS 1–9: rays that structures find hard, each in every structure × bound × space against brute force.
#include <gtest/gtest.h>

#include "tests/property/stress_scenes.h"
#include "tests/support/effort.h"
#include "tests/support/same_hits.h"

namespace tessera {
namespace {

/// Starts outside and inside, on planes and off them.
std::vector<Vec3> origins(int count) {
  Random random(1);
  std::vector<Vec3> out{{0, 0, 0}, {0.5F, 0.5F, 0.5F}, {-8, 1, 1}};
  while (static_cast<int>(out.size()) < count)
    out.push_back(random.bits() % 2 ? lattice_point(random, 8) : to_float(random.in_cube() * 8));
  return out;
}

TEST(StressRays, PlusAndMinusZeroAreTheSame_Stress01) {
  const auto scene = block_scene();
  std::vector<Ray> plus, minus;
  for (const Vec3 origin : origins(effort(40, 2000)))
    for (int pattern = 0; pattern < 27; ++pattern) {
      const Vec3 d{static_cast<float>(pattern % 3 - 1), static_cast<float>(pattern / 3 % 3 - 1),
                   static_cast<float>(pattern / 9 - 1)};
      if (d == Vec3{}) continue;
      const auto with_zero = [&](float zero) {
        return Vec3{d.x == 0 ? zero : d.x, d.y == 0 ? zero : d.y, d.z == 0 ? zero : d.z};
      };
      plus.push_back({origin, with_zero(0.0F)});
      minus.push_back({origin, with_zero(-0.0F)});
    }
  const auto known = known_rays(scene, plus), known_minus = known_rays(scene, minus);
  EXPECT_GT(count_hits(known), known.size() / 5);
  for (std::size_t i = 0; i < known.size(); ++i) ASSERT_EQ(known[i].hit, known_minus[i].hit) << "ray " << i;
  expect_same_hits_everywhere(scene, known, "+0");
  expect_same_hits_everywhere(scene, known_minus, "-0");
}

TEST(StressRays, InASlabPlaneHitTheClosedBox_Stress02) {
  const auto scene = block_scene();
  Random random(2);
  std::vector<Ray> rays;
  for (int i = 0; i < effort(1500, 100'000); ++i) {
    Ray ray{lattice_point(random, 8), {}};
    const int in_plane = i % 3;  // the coordinate stays on a face; the way leads anywhere in that plane
    ray.direction[(in_plane + 1) % 3] = static_cast<float>(random.uniform(-1, 1));
    ray.direction[(in_plane + 2) % 3] = i % 4 == 0 ? 0 : static_cast<float>(random.uniform(-1, 1));
    rays.push_back(ray);
  }
  const auto known = known_rays(scene, rays);
  EXPECT_GT(count_hits(known), known.size() / 5);
  expect_same_hits_everywhere(scene, known, "in a plane");

  // Where nothing but the closed side of a box is met: the quad's box has no extent on y, and the ray lies in its edge.
  const auto edge = SceneBuilder().add(flat_quad(0, {3, 0, 0}, 1, 1)).build();
  const std::vector<KnownRay> along{{{{0, 1, 0.5F}, {1, 0, 0}}, Hit{3, 0, 0}}, {{{0, 0, 1}, {1, 0, 0}}, Hit{3, 0, 0}}};
  expect_same_hits_everywhere(edge, along, "through an edge");
}

TEST(StressRays, AlongEdgesAndDiagonalsLoseNoHit_Stress03) {
  // Triangles that touch their boxes' edges and corners in one point, which is what the ray meets.
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    const auto x = static_cast<float>(3 * i);
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {{x, 0, 0}, {x + 1, 1, 0}, {x + 1, 0, 1}});
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  const auto scene = SceneBuilder().add(mesh).build();
  std::vector<KnownRay> known;
  for (std::uint32_t i = 0; i < 8; ++i) {
    const Vec3 tip = mesh.positions[3 * i];
    known.push_back({{tip + Vec3{0, 5, 0}, {0, -1, 0}}, Hit{5, 0, i}});
    known.push_back({{tip + Vec3{0, 0, -5}, {0, 0, 1}}, Hit{5, 0, i}});
    for (const float x : {-1.0F, 1.0F}) known.push_back({{tip - Vec3{x, 1, -1} * 4, {x, 1, -1}}, Hit{4, 0, i}});
  }
  known.push_back({{{-2, 0, 0}, {1, 0, 0}}, Hit{2, 0, 0}});
  expect_same_hits_everywhere(scene, known, "at a tip");
  for (const KnownRay& k : known_rays(scene, {known[0].ray, known[2].ray, known.back().ray})) EXPECT_TRUE(k.hit);

  const auto blocks = block_scene();
  Random random(3);
  std::vector<Ray> rays;
  for (int i = 0; i < effort(1500, 100'000); ++i) {
    const Vec3 from = lattice_point(random, 8), sign{random.bits() % 2 ? 1.0F : -1.0F, random.bits() % 2 ? 1.0F : -1.0F,
                                                     random.bits() % 2 ? 1.0F : -1.0F};
    Vec3 d = sign;
    if (i % 3 == 0) d[i / 3 % 3] = 0;  // a face's diagonal
    if (i % 3 == 1) d = {}, d[i / 3 % 3] = 1;
    rays.push_back({from, d});
  }
  const auto all = known_rays(blocks, rays);
  EXPECT_GT(count_hits(all), all.size() / 5);
  expect_same_hits_everywhere(blocks, all, "along edges and diagonals");
}

TEST(StressRays, NeverMissFlatBoxes_Stress04) {
  Random random(4);
  SceneBuilder b;
  std::vector<Quad> quads;
  TriangleMesh mesh;
  for (int i = 0; i < 120; ++i) {
    const Quad quad = flat_quad(i % 3, to_float(random.in_cube() * 10), static_cast<float>(random.uniform(0.1, 3)),
                                static_cast<float>(random.uniform(0.1, 3)));
    quads.push_back(quad);
    if (i % 2 == 0) {
      b.add(quad);
      continue;
    }
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), quad.corners.begin(), quad.corners.end());
    mesh.triangles.insert(mesh.triangles.end(), {{first, first + 1, first + 2}, {first, first + 2, first + 3}});
  }
  const auto scene = b.add(mesh).build();
  std::vector<Ray> rays;
  for (int i = 0; i < effort(6'000, 1'000'000); ++i) {
    const auto& c = quads[random.bits() % quads.size()].corners;
    const Vec3 u = c[1] - c[0], v = c[3] - c[0];
    const Vec3 target =
        c[0] + u * static_cast<float>(random.uniform(0.01, 0.99)) + v * static_cast<float>(random.uniform(0.01, 0.99));
    const Vec3 origin = to_float(random.in_cube() * random.magnitude(0, 3));
    rays.push_back({origin, target - origin});
  }
  const auto known = known_rays(scene, rays);
  EXPECT_EQ(count_hits(known), known.size()) << "brute force";
  expect_same_hits_everywhere(scene, known, "flat boxes");
}

TEST(StressRays, HardlyAnyDirectionIsNone_Stress05) {
  const auto scene = block_scene();
  constexpr float kHardly[] = {5.3e-17F, -5.30287619e-17F, 1e-38F, -1e-38F, 1e-44F, -1e-45F};
  Random random(5);
  std::vector<Ray> with, without;
  for (int i = 0; i < effort(1200, 120'000); ++i) {
    // In planes, and as often so far off them, and off the diagonals of faces, that so small a slope reaches none.
    const Vec3 origin = lattice_point(random, 8) + (i % 2 ? Vec3{0.25F, 0.375F, 0.4375F} : Vec3{});
    const auto along = [&, turn = i / 12 % 3](float x, float y, float z) {
      const Vec3 v{x, y, z};
      return Vec3{v[turn], v[(turn + 1) % 3], v[(turn + 2) % 3]};
    };
    const float y = static_cast<float>(random.uniform(-1, 1)), z = random.bits() % 2 ? 0 : 1;
    without.push_back({origin, along(0, y, z)});
    with.push_back({origin, along(kHardly[i / 2 % 6], y, z)});
  }
  const auto known = known_rays(scene, with), none = known_rays(scene, without);
  EXPECT_GT(count_hits(known), known.size() / 10);
  for (std::size_t i = 1; i < known.size(); i += 2) ASSERT_EQ(known[i].hit, none[i].hit) << "ray " << i;
  expect_same_hits_everywhere(scene, known, "hardly any slope");
}

TEST(StressRays, MayHaveAnyLength_Stress06) {
  Random random(6);
  const auto scene = random_scene(6, 40);
  std::vector<Ray> rays, decimal;
  for (int i = 0; i < effort(300, 20'000); ++i) {
    const Vec3 origin = to_float(random.in_cube() * 12);
    rays.push_back({origin, to_float(random.direction())});
    decimal.push_back({origin, to_float(random.direction() * random.magnitude(-20, 20))});
  }
  const auto known = known_rays(scene, rays);
  EXPECT_GT(count_hits(known), known.size() / 4);
  expect_same_hits_everywhere(scene, known_rays(scene, decimal), "any length");
  // A power of two changes no digit: the same hits, and t scaled without any error.
  for (const int power : {-66, -20, 20, 66}) {
    std::vector<KnownRay> scaled = known;
    for (auto& [ray, hit] : scaled) {
      ray.direction = ray.direction * std::ldexp(1.0F, power);
      if (hit) hit->t = std::ldexp(hit->t, -power);
    }
    expect_same_hits_everywhere(scene, scaled, "length 2^" + std::to_string(power));
  }
}

TEST(StressRays, ThatAreNoneTestNothing_Stress07_Stress09) {
  const auto scene = random_scene(3, 60);
  const float nan = std::nanf("");
  std::vector<Ray> rays{{{}, {}},
                        {{}, {0, -0.0F, 0}},
                        {{}, {1, 0, 0}, 0, nan},
                        {{}, {1, 0, 0}, nan, 1},
                        {{}, {1, 0, 0}, 2, 1},
                        {{}, {1, 0, 0}, 1, 1},
                        {{}, {1, 0, 0}, kInfinity, kInfinity},
                        {{}, {1, 0, 0}, 0, -kInfinity}};
  for (const float bad : {nan, kInfinity, -kInfinity})
    for (int axis = 0; axis < 3; ++axis) {
      rays.push_back({{0, 0, 0}, {1, 0.5F, 0.25F}});
      rays.back().origin[axis] = bad;
      rays.push_back({{0, 0, 0}, {1, 0.5F, 0.25F}});
      rays.back().direction[axis] = bad;
    }
  for (const AccelOptions& options : accel_choices()) {
    const auto accel = make_accel(scene, options);
    for (const Ray& ray : rays) {
      TestCounts counts;
      EXPECT_FALSE(accel->closest(ray, {nullptr, &counts})) << describe(options);
      EXPECT_FALSE(accel->occluded(ray, {nullptr, &counts})) << describe(options);
      EXPECT_EQ(counts, TestCounts()) << describe(options) << ": it takes no longer than a ray that hits";
    }
  }
}

/// Open at both ends: a hit at t is found with ends beside t, and not with t itself as an end.
TEST(StressRays, HaveAnOpenInterval_Stress08) {
  const auto scene = random_scene(8, 40);
  Random random(8);
  std::vector<Ray> rays, ends;
  for (int i = 0; i < effort(1000, 50'000); ++i)
    rays.push_back({to_float(random.in_cube() * 12), to_float(random.direction() * random.magnitude(-2, 2))});
  for (const auto& [ray, hit] : known_rays(scene, rays)) {
    if (!hit) continue;
    const float before = std::nextafter(hit->t, -kInfinity), after = std::nextafter(hit->t, kInfinity);
    for (const auto& [lo, hi] : {std::pair{0.0F, hit->t}, {hit->t, kInfinity}, {before, after}, {hit->t, after}})
      ends.push_back({ray.origin, ray.direction, lo, hi});
  }
  const auto known = known_rays(scene, ends);
  for (std::size_t i = 0; i < known.size(); i += 4) {
    ASSERT_FALSE(known[i].hit) << "nothing lies before the closest hit";
    if (known[i + 1].hit) {
      ASSERT_GT(known[i + 1].hit->t, known[i + 1].ray.t_min);
    }
    ASSERT_TRUE(known[i + 2].hit);
    ASSERT_FALSE(known[i + 3].hit) << "no float lies between";
  }
  EXPECT_GT(known.size(), rays.size());
  expect_same_hits_everywhere(scene, known, "ends at t");
}

}  // namespace
}  // namespace tessera

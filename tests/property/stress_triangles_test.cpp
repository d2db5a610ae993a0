// STRESS 15–21 and 27: triangles at the limits, in every structure × bound × space against brute force, and brute
// force against wider precision.
#include <gtest/gtest.h>

#include "core/integrator/spawn.h"
#include "tests/property/stress_scenes.h"
#include "tests/support/effort.h"
#include "tests/support/same_hits.h"
#include "tests/support/wide_oracle.h"

namespace tessera {
namespace {

void append(TriangleMesh& mesh, Vec3 a, Vec3 b, Vec3 c) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), {a, b, c});
  mesh.triangles.push_back({first, first + 1, first + 2});
}

/// A needle of aspect 10^7, or as near as floats allow, between two random points.
void append_needle(TriangleMesh& mesh, Random& random) {
  const Vec3 a = to_float(random.in_cube()), b = to_float(random.in_cube());
  append(mesh, a, b, to_float(to_double(b) + random.direction() * 1e-7));
}

Ray aimed_at_a_needle(const TriangleMesh& mesh, Random& random) {
  const TriangleIndices& t = mesh.triangles[random.bits() % mesh.triangles.size()];
  const Vec3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
  const double along = random.uniform(0, 1), across = random.uniform(0, 1);
  const Vec3d base = to_double(b) + (to_double(c) - to_double(b)) * across;
  const Vec3 target = to_float(to_double(a) + (base - to_double(a)) * along);
  const Vec3 origin = to_float(random.in_cube() * random.magnitude(0, 1));
  return {origin, target - origin};
}

TEST(StressTriangles, NeedlesAreHitWhereTheyAre_Stress15) {
  int hits = 0;
  for (int seed = 0; seed < effort(4, 100); ++seed) {
    Random random(seed);
    TriangleMesh mesh;
    for (int i = 0; i < 60; ++i) append_needle(mesh, random);
    const auto scene = SceneBuilder().add(mesh).build();
    std::vector<Ray> rays;
    for (int i = 0; i < effort(2000, 10'000); ++i) rays.push_back(aimed_at_a_needle(mesh, random));
    const auto known = known_rays(scene, rays);
    for (std::size_t i = 0; i < known.size(); ++i) {
      const auto& [ray, hit] = known[i];
      if (!hit) continue;
      ++hits;
      const TriangleIndices& t = mesh.triangles[hit->primitive];
      const std::array corners{mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
      const Crossings exact = crossings(corners, ray);
      if (exact.all.empty()) continue;  // within rounding of an edge
      // One rounding to float, and double's share: along the ray as its angle magnifies it, and 10^7 times for needles.
      const Wide way = std::sqrt(dot(widen(ray.direction), widen(ray.direction)));
      const Wide leeway =
          0x1p-24L * std::abs(exact.all[0].t) * 1.001L + 0x1p-48L * 1e7L / (way * exact.all[0].steepness);
      EXPECT_LE(std::abs(hit->t - exact.all[0].t), leeway) << "seed " << seed << ", ray " << i;
    }
    expect_same_hits_everywhere(scene, known, "needles " + std::to_string(seed));
  }
  EXPECT_GT(hits, 1000);
}

TEST(StressTriangles, OfNoAreaAreNeverHit_Stress16_Stress17) {
  Random random(16);
  TriangleMesh mesh;
  std::vector<bool> has_area;
  for (int i = 0; i < 120; ++i) {
    const Vec3 a = to_float(random.in_cube()), b = to_float(random.in_cube());
    const Vec3 step{0.25F, -0.5F, 0.125F};  // its multiples are exact, so these lie on a line exactly
    const Vec3 even = to_float({std::round(a.x * 8), std::round(a.y * 8), std::round(a.z * 8)}) * 0.125F;
    switch (i % 5) {
      case 0:
        append(mesh, even, even + step, even + step * 3);
        break;
      case 1:
        append(mesh, a, a, b);
        break;
      case 2:
        append(mesh, a, a, a);
        break;
      case 3:
        append(mesh, a, b, b);
        mesh.triangles.back()[2] = mesh.triangles.back()[1];
        break;
      default:
        append(mesh, a, b, to_float(random.in_cube()));
        break;
    }
    has_area.push_back(i % 5 == 4);
  }
  const auto scene = SceneBuilder().add(mesh).build();
  std::vector<Ray> rays;
  for (int i = 0; i < effort(1500, 200'000); ++i) {
    const TriangleIndices& t = mesh.triangles[random.bits() % mesh.triangles.size()];
    const Vec3 target = i % 2 ? mesh.positions[t[0]] : (mesh.positions[t[0]] + mesh.positions[t[1]]) * 0.5F;
    // Whole multiples away, so that the ray meets the line exactly.
    const Vec3 origin = target + lattice_point(random, 4);
    if (origin == target) continue;
    rays.push_back({origin, target - origin});
  }
  rays.push_back({{0.25F, -0.5F, 2}, {0, 0, -1}});
  const auto known = known_rays(scene, rays);
  for (std::size_t i = 0; i < known.size(); ++i) {
    const auto& [ray, hit] = known[i];
    if (!hit) continue;
    ASSERT_TRUE(has_area[hit->primitive]) << "ray " << i;
    const SurfacePoint at = surface(scene->shapes[0], hit->primitive, ray, hit->t);
    ASSERT_TRUE(is_finite(at.geometric_normal) && is_finite(at.shading_normal) && is_finite(at.position));
  }
  EXPECT_GT(count_hits(known), known.size() / 20);
  expect_same_hits_everywhere(scene, known, "no area");

  const auto line = SceneBuilder().add(TriangleMesh{{{0, 0, 0}, {1, 2, 0}, {3, 6, 0}}, {{0, 1, 2}}, {}}).build();
  const std::vector<KnownRay> missed{{{{1, 2, 5}, {0, 0, -1}}, {}}, {{{2, 4, 5}, {0, 0, -1}}, {}}};
  expect_same_hits_everywhere(line, missed, "at a line");
}

/// Triangles, quads and quadrics whose coordinates and rays have few enough digits to be scaled without rounding.
std::shared_ptr<const Scene> scaled_scene(float scale) {
  Random random(18);
  const auto coarse = [&] {
    const Vec3d p = random.in_cube() * 4096;
    return to_float({std::round(p.x), std::round(p.y), std::round(p.z)}) * (scale / 256);
  };
  SceneBuilder b;
  TriangleMesh mesh;
  for (int i = 0; i < 40; ++i) append(mesh, coarse(), coarse(), coarse());
  b.add(mesh);
  for (int i = 0; i < 10; ++i) {
    const float radius = static_cast<float>(1 + random.bits() % 512) * (scale / 256);
    b.add(Sphere{coarse(), radius}).add(Cylinder{coarse(), coarse(), radius});
    b.add(Disk{coarse(), UnitVec3::x(), radius}).add(flat_quad(i % 3, coarse(), radius, radius * 2));
  }
  return b.build();
}

std::vector<Ray> scaled_rays(float scale, int count) {
  Random random(19);
  std::vector<Ray> rays;
  for (int i = 0; i < count; ++i) {
    const auto coarse = [&] {
      const Vec3d p = random.in_cube() * 8192;
      return to_float({std::round(p.x), std::round(p.y), std::round(p.z)}) * (scale / 256);
    };
    const Vec3 origin = coarse();
    rays.push_back({origin, coarse() - origin});
  }
  return rays;
}

/// 2^±50 are about 10^±15, 2^-100 is about 10^-30.
TEST(StressTriangles, ScaledScenesHaveTheSameHits_Stress18_Stress19) {
  const int count = effort(500, 20'000);
  const auto at_one = known_rays(scaled_scene(1), scaled_rays(1, count));
  EXPECT_GT(count_hits(at_one), at_one.size() / 3);
  for (const int exponent : {-100, -50, -33, -10, 10, 33, 50}) {
    const float scale = std::ldexp(1.0F, exponent);
    auto scaled = at_one;
    const auto rays = scaled_rays(scale, count);
    for (std::size_t i = 0; i < scaled.size(); ++i) scaled[i].ray = rays[i];
    expect_same_hits_everywhere(scaled_scene(scale), scaled, "scale 2^" + std::to_string(exponent));
  }
}

/// What is too large to be traced exactly never gets into a scene.
TEST(StressTriangles, TooLargeOnesAreDropped_Stress19_Stress27) {
  const float nan = std::nanf("");
  TriangleMesh mesh = icosphere(2);
  const TriangleMesh good = mesh;
  for (const float bad : {nan, kInfinity, -kInfinity, 1e30F, -1.9e18F})
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 p{0.5F, 0.5F, 0.5F};
      p[axis] = bad;
      mesh.positions.push_back(p);
      const auto at = static_cast<std::uint32_t>(mesh.positions.size() - 1);
      mesh.triangles.insert(mesh.triangles.begin(), {0, 1, at});
      mesh.triangles.push_back({at, 5, 7});
    }
  EXPECT_EQ(drop_unusable_triangles(mesh).not_finite, 30U);
  EXPECT_EQ(mesh.triangles, good.triangles);
  Random random(27);
  std::vector<Ray> rays;
  for (int i = 0; i < 300; ++i) rays.push_back({to_float(random.in_cube()), to_float(random.direction())});
  // What is left of the mesh, its unusable positions included, is the good mesh.
  expect_same_hits_everywhere(SceneBuilder().add(mesh).build(), known_rays(SceneBuilder().add(good).build(), rays),
                              "the rest");
}

TEST(StressTriangles, OfDenormalExtentAreHitAlike_Stress20) {
  TriangleMesh mesh;
  Random random(20);
  for (int i = 0; i < 40; ++i) {
    const auto point = [&] { return to_float(random.in_cube() * 1e-40); };
    append(mesh, point(), point(), point());
  }
  const auto alone = SceneBuilder().add(mesh).build(),
             beside = SceneBuilder().add(mesh).add(Sphere{{3, 0, 0}, 1}).build();
  std::vector<Ray> rays;
  for (int i = 0; i < effort(500, 20'000); ++i) {
    const Vec3 target = to_float(random.in_cube() * 1e-40);
    const Vec3 origin = i % 2 ? to_float(random.in_cube() * 1e-39) : Vec3{target.x, target.y, i % 4 ? -1.0F : 1.0F};
    rays.push_back({origin, i % 2 ? to_float(random.direction()) : Vec3{0, 0, i % 4 ? 1.0F : -1.0F}});
  }
  const auto known = known_rays(alone, rays);
  EXPECT_GT(count_hits(known), known.size() / 10);
  expect_same_hits_everywhere(alone, known, "alone");
  expect_same_hits_everywhere(beside, known_rays(beside, rays), "beside a sphere");
}

}  // namespace
}  // namespace tessera

// The oracle of brute force, on answers worked out by hand; then brute force against it.
#include "tests/support/wide_oracle.h"

#include <gtest/gtest.h>

#include "core/accel/accel.h"
#include "tests/support/effort.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

TEST(WideOracle, SumsExactly) {
  ExactSum sum;
  for (const double v : {1e100, 1.0, 0x1p-60, -1e100, -1.0}) sum.add(v);
  EXPECT_EQ(sum.value(), 0x1p-60L);
  sum.add(-0x1p-60);
  EXPECT_EQ(sum.value(), 0);
}

TEST(WideOracle, KnowsTheSignOfDeterminantsThatDoubleLoses) {
  const Vec3 o{}, x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  EXPECT_EQ(determinant({o, x}, {o, y}, {o, z}), 1);
  EXPECT_EQ(determinant({o, y}, {o, x}, {o, z}), -1);
  EXPECT_EQ(determinant({z, z}, {o, y}, {o, z}), 0);
  // (1 + ε)(1 − ε) − 1·1 = −ε² with ε = 2^-23: gone in the products of float and of the roundings of double.
  const float e = 0x1p-23F;
  EXPECT_EQ(determinant({o, {1 + e, 1, 0}}, {o, {1, 1 - e, 0}}, {o, z}), -0x1p-46L);
  // The same 2^40 times over on top of each other: 2^-46 beside products of 2^100.
  const float far = 0x1p50F;
  EXPECT_EQ(determinant({o, {far, 0, 0}}, {o, {0, far, 0}}, {o, {0, 0, 0x1p-146F}}), 0x1p-46L);
  EXPECT_EQ(determinant({o, {far, far, 1}}, {o, {far, far, 1}}, {o, {0, 3, 7}}), 0);
}

TEST(WideOracle, HitsATriangleWhereItIs) {
  const std::array<Vec3, 3> t{Vec3{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
  const auto at = [&](float x, float y) { return crossings(t, {{x, y, 3}, {0, 0, -2}}); };
  ASSERT_EQ(at(1, 1).all.size(), 1U);
  EXPECT_EQ(at(1, 1).all[0].t, 1.5L);
  EXPECT_EQ(at(1, 1).all[0].steepness, 1);
  EXPECT_EQ(at(1, 1).margin, 1) << "from the nearest edge";
  EXPECT_EQ(at(2, 2).all.size(), 1U) << "on the long edge";
  EXPECT_EQ(at(2, 2).margin, 0);
  EXPECT_EQ(at(4, 0).all.size(), 1U) << "on a corner";
  EXPECT_TRUE(at(std::nextafter(2.0F, 3.0F), 2).all.empty());
  EXPECT_TRUE(crossings(t, {{-1, 1, 0}, {1, 0, 0}}).all.empty()) << "edge-on";
  EXPECT_TRUE(crossings({t[0], t[1], t[1]}, {{1, 0, 3}, {0, 0, -1}}).all.empty()) << "of no area";
}

TEST(WideOracle, TracesInOrder) {
  const auto scene = SceneBuilder()
                         .add(Sphere{{0, 0, -5}, 1})
                         .add(Quad{{{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}}})
                         .add(Sphere{{0, 0, -5}, 1})
                         .add(Sphere{{9, 0, 0}, 1})
                         .build();
  const Ray ray{{0.25F, 0, 3}, {0, 0, -1}};
  const WideAnswer all = wide_trace(*scene, ray);
  ASSERT_EQ(all.hits.size(), 3U);
  EXPECT_EQ(all.closest()->object, 1U);
  EXPECT_EQ(all.closest()->t, 3);
  EXPECT_EQ(all.hits[1].object, 0U) << "of twins the first";
  EXPECT_EQ(all.hits[1].t, 8 - std::sqrt(0.9375L));
  EXPECT_NEAR(static_cast<double>(all.margin), 0.25 / std::sqrt(2.0), 1e-15) << "the quad's diagonal";
  EXPECT_EQ(wide_trace(*scene, {ray.origin, ray.direction, 3.5F}).hits.size(), 2U);
  EXPECT_EQ(wide_trace(*scene, {ray.origin, ray.direction, 0, 3.5F}).hits.size(), 1U);
  EXPECT_TRUE(wide_trace(*scene, {{0, 50, 0}, {1, 0, 0}}).hits.empty());
}

/// Where no edge, rim or silhouette is nearer than rounding: the same hit or miss, t to 2 ulp, and the same
/// primitive wherever t tells two apart.
TEST(WideOracle, AgreesWithBruteForce) {
  int hits = 0, unsure = 0;
  const int scenes = effort(100, 1000), rays = 300;
  for (int seed = 0; seed < scenes; ++seed) {
    Random random(seed);
    const double size = random.magnitude(-6, 6);
    const auto scene = random_scene(seed, 20, size);
    const auto brute = make_accel(scene, {AccelKind::brute});
    for (int i = 0; i < rays; ++i) {
      const Vec3 origin = to_float(random.in_cube() * (size * random.magnitude(-1, 2)));
      const Ray ray{origin, to_float(random.in_cube() * size) - origin};
      const WideAnswer exact = wide_trace(*scene, ray);
      const Wide reach = length(to_double(origin)) + 10 * size;
      if (exact.margin < reach * 0x1p-42L) {
        ++unsure;
        continue;
      }
      const auto hit = brute->closest(ray);
      ASSERT_EQ(hit.has_value(), exact.closest().has_value()) << "scene " << seed << ", ray " << i;
      if (!hit) continue;
      ++hits;
      const auto mine = std::ranges::find_if(
          exact.hits, [&](const WideHit& h) { return h.object == hit->object && h.primitive == hit->primitive; });
      ASSERT_NE(mine, exact.hits.end()) << "scene " << seed << ", ray " << i;
      const Wide first = exact.closest()->t;
      const Wide way = length(to_double(ray.direction)), graze = reach * 0x1p-46L / (way * mine->steepness);
      EXPECT_LE(std::abs(hit->t - mine->t), 2 * ulp(mine->t) + graze) << "scene " << seed << ", ray " << i;
      EXPECT_LE(mine->t - first, 2 * ulp(first) + graze)
          << "scene " << seed << ", ray " << i << ": another one is nearer";
    }
  }
  EXPECT_GT(hits, scenes * rays / 4);
  EXPECT_LT(unsure, scenes * rays / 100);
}

/// Whether a triangle is hit is decided exactly: no leeway at edges, corners, needles or triangles seen edge-on.
TEST(WideOracle, AgreesWithBruteForceOnTrianglesWithoutLeeway) {
  int hits = 0, on_edges = 0;
  for (int seed = 0; seed < effort(60, 2000); ++seed) {
    Random random(seed);
    const double size = random.magnitude(-6, 6);
    TriangleMesh mesh;
    for (int i = 0; i < 30; ++i) mesh.positions.push_back(to_float(random.in_cube() * size));
    for (std::uint32_t i = 0; i < 28; ++i) {
      if (i % 4 == 0)
        mesh.positions[i + 2] = (mesh.positions[i] + mesh.positions[i + 1]) * 0.5F;  // no more than a line
      mesh.triangles.push_back({i, i + 1, i + 2});
    }
    const auto scene = SceneBuilder().add(mesh).build();
    const auto brute = make_accel(scene, {AccelKind::brute});
    for (int i = 0; i < 300; ++i) {
      const Vec3 a = mesh.positions[random.bits() % 30], b = mesh.positions[random.bits() % 30];
      const Vec3 target = i % 3 == 0 ? a : (a + b) * 0.5F;
      const Vec3 origin = i % 7 == 0 ? a + (a - b) : to_float(random.in_cube() * (size * random.magnitude(0, 2)));
      if (origin == target) continue;
      const Ray ray{origin, target - origin, 1e-3F};
      const WideAnswer exact = wide_trace(*scene, ray);
      const auto hit = brute->closest(ray);
      ASSERT_EQ(hit.has_value(), exact.closest().has_value()) << "scene " << seed << ", ray " << i;
      hits += hit.has_value();
      on_edges += exact.margin < size * 0x1p-40L;
    }
  }
  EXPECT_GT(hits, effort(60, 2000) * 100);
  EXPECT_GT(on_edges, effort(60, 2000));
}

}  // namespace
}  // namespace tessera

// STRESS 44–51: scenes that are hard on one structure or another, in all of them.
#include <gtest/gtest.h>

#include "core/plan/plan.h"
#include "tests/property/stress_scenes.h"
#include "tests/support/effort.h"
#include "tests/support/same_hits.h"

namespace tessera {
namespace {

std::vector<Ray> rays_in(Random& random, const Aabb& box, int count) {
  const Vec3d half = (to_double(box.hi) - to_double(box.lo)) * 0.5, middle = to_double(box.lo) + half;
  const auto at = [&](double reach) {
    const Vec3d p = random.in_cube() * reach;
    return to_float(middle + Vec3d{p.x * half.x, p.y * half.y, p.z * half.z});
  };
  std::vector<Ray> rays;
  while (static_cast<int>(rays.size()) < count) {
    const Vec3 origin = at(2), target = at(1);
    if (origin != target) rays.push_back({origin, target - origin});
  }
  return rays;
}

void expect_same_and_small(const std::shared_ptr<const Scene>& scene, const std::vector<KnownRay>& known,
                           std::uint64_t most_bytes, const std::string& what) {
  for (const AccelOptions& options : accel_choices()) {
    const auto accel = make_accel(scene, options);
    EXPECT_LE(accel->stats().bytes, most_bytes) << describe(options) << ", " << what;
    expect_same_hits(*accel, known, describe(options) + ", " + what);
  }
}

TEST(StressStructures, FlatPointAndEmptyScenes_Stress44) {
  // 10⁵ × 10⁵ × 0: triangles and quads in one plane.
  Random random(44);
  SceneBuilder b;
  TriangleMesh mesh = grid_plane(20);
  for (Vec3& p : mesh.positions) p = {p.x * 5e4F, p.y * 5e4F, 0};
  b.add(mesh);
  for (int i = 0; i < 50; ++i)
    b.add(flat_quad(2, to_float({random.uniform(-5e4, 4e4), random.uniform(-5e4, 4e4), 0}), 1e4F, 3));
  const auto flat = b.build();
  std::vector<Ray> rays;
  for (int i = 0; i < effort(600, 100'000); ++i) {
    const Vec3 target = to_float({random.uniform(-5e4, 5e4), random.uniform(-5e4, 5e4), 0});
    const Vec3 origin = i % 3 == 0   ? target + Vec3{0, 0, 7}
                        : i % 3 == 1 ? to_float(random.in_cube() * 1e5)
                                     : Vec3{target.y, target.x, 0};
    if (origin != target) rays.push_back({origin, target - origin});
  }
  const auto known = known_rays(flat, rays);
  EXPECT_GT(count_hits(known), known.size() / 2);
  expect_same_and_small(flat, known, 4 << 20, "flat");

  // Many triangles that are one point, and one that isn't, in the same mesh or not.
  TriangleMesh point;
  point.positions = {{1, 2, 3}, {1, 2, 3}, {1, 2, 3}};
  point.triangles.assign(100, {0, 1, 2});
  const std::vector<KnownRay> missed{
      {{{1, 2, 9}, {0, 0, -1}}, {}}, {{{-5, 2, 3}, {1, 0, 0}}, {}}, {{{}, {1, 2, 3}}, {}}};
  expect_same_and_small(SceneBuilder().add(point).build(), missed, 1 << 20, "a point");
  const auto beside = SceneBuilder().add(point).add(Sphere{{1, 2, -3}, 1}).build();
  expect_same_and_small(beside, known_rays(beside, {missed[0].ray, missed[1].ray, missed[2].ray}), 1 << 20, "beside");

  expect_same_and_small(SceneBuilder().build(), missed, 1 << 16, "empty");
  expect_same_and_small(SceneBuilder().add(TriangleMesh{}).build(), missed, 1 << 16, "an empty mesh");
}

/// Rays along the borders and the diagonals of cells. A root of 16³ whole numbers and as many items as make the grid
/// (4 cells an item) and the octree cut at whole and half numbers.
TEST(StressStructures, WalksAlongCellBordersAndDiagonals_Stress45) {
  Random random(45);
  TriangleMesh mesh;
  const auto whole = [&](unsigned n) { return static_cast<float>(random.bits() % n); };
  append_box(mesh, {{0, 0, 0}, {1, 1, 1}});
  append_box(mesh, {{15, 15, 15}, {16, 16, 16}});
  for (int i = 0; i < 83; ++i) {
    const Vec3 lo{whole(16), whole(16), whole(16)};
    append_box(mesh, {lo, lo + Vec3{1, 1, i % 2 ? 1.0F : 0.5F}});
  }
  SceneBuilder b;
  b.add(mesh);
  for (int i = 0; i < 40; ++i) b.add(flat_quad(i % 3, {whole(15), whole(15), whole(15)}, 1, 1));
  const auto scene = b.build();
  std::vector<Ray> rays;
  for (int i = 0; i < effort(2000, 1'000'000); ++i) {
    const auto half = [&] { return whole(41) * 0.5F - 2; };
    const auto sign = [&] { return random.bits() % 2 ? 1.0F : -1.0F; };
    Vec3 d{sign(), sign(), sign()};
    if (i % 4 == 0) d[i / 4 % 3] = 0;
    if (i % 4 == 1) d = {}, d[i / 4 % 3] = sign();
    if (i % 4 == 2) d[i / 4 % 3] *= std::ldexp(1.0F, -static_cast<int>(random.bits() % 30));
    rays.push_back({{half(), half(), half()}, d});
  }
  const auto known = known_rays(scene, rays);
  EXPECT_GT(count_hits(known), known.size() / 6);
  expect_same_hits_everywhere(scene, known, "borders and diagonals");
}

TEST(StressStructures, ATeapotInAStadium_Stress46) {
  Random random(46);
  const Vec3 place{300, -200, 499};
  TriangleMesh teapot = icosphere(3, 1e-3F, place), stadium;
  append_box(stadium, {{-500, -500, -500}, {500, 500, 500}});
  // In one mesh, and as two objects.
  TriangleMesh both = stadium;
  for (const auto& [x, y, z] : teapot.triangles)
    both.triangles.push_back({x + static_cast<std::uint32_t>(both.positions.size()),
                              y + static_cast<std::uint32_t>(both.positions.size()),
                              z + static_cast<std::uint32_t>(both.positions.size())});
  both.positions.insert(both.positions.end(), teapot.positions.begin(), teapot.positions.end());
  std::vector<Ray> rays;
  for (int i = 0; i < effort(800, 50'000); ++i) {
    const Vec3 target = to_float(to_double(place) + random.in_cube() * 1.2e-3);
    const Vec3 origin = i % 2 ? to_float(random.in_cube() * 499) : to_float(to_double(place) + random.in_cube() * 3e-3);
    rays.push_back({origin, target - origin});
  }
  for (const auto& scene : {SceneBuilder().add(both).build(), SceneBuilder().add(stadium).add(teapot).build()}) {
    const auto known = known_rays(scene, rays);
    EXPECT_EQ(count_hits(known), known.size()) << "the stadium at least";
    // The cap that trees of planes state: 12 entries an item, each of which may be a leaf of its own in a binary tree.
    expect_same_and_small(scene, known, both.triangles.size() * 12 * (4 + 2 * 28), "stadium");
  }
}

/// Bytes per item don't grow with the number of equal items, nor does anything lose one.
TEST(StressStructures, EqualPrimitives_Stress47_Stress49) {
  std::vector<std::vector<std::uint64_t>> bytes;
  const int few = 500, many = effort(2000, 8000);
  for (const int count : {few, many}) {
    SceneBuilder b;
    TriangleMesh mesh = icosphere(0);
    const auto once = mesh.triangles;
    for (int i = 1; i < count / 20; ++i) mesh.triangles.insert(mesh.triangles.end(), once.begin(), once.end());
    b.add(mesh);
    const auto ball = b.shape(Sphere{{0, 0, 0}, 0.5F});
    for (int i = 0; i < count; ++i) b.place(ball);
    const auto scene = b.build();
    Random random(47);
    const auto known = known_rays(scene, rays_in(random, {{-1, -1, -1}, {1, 1, 1}}, 60));
    bytes.emplace_back();
    for (const AccelOptions& options : accel_choices()) {
      const auto accel = make_accel(scene, options);
      bytes.back().push_back(accel->stats().bytes);
      EXPECT_LE(accel->stats().depth, 64U) << describe(options);
      expect_same_hits(*accel, known, describe(options) + ", " + std::to_string(count));
    }
  }
  for (std::size_t i = 0; i < bytes[0].size(); ++i)
    EXPECT_LE(bytes[1][i], bytes[0][i] * static_cast<std::uint64_t>(2 * many / few)) << describe(accel_choices()[i]);
}

TEST(StressStructures, CoordinatesOnSplitPlanesAndClusters_Stress48) {
  // Flat items on every middle that there is between 0 and 16, and clusters that halve again and again.
  SceneBuilder b;
  TriangleMesh mesh;
  Random random(48);
  const auto whole = [&](unsigned n) { return static_cast<float>(random.bits() % n); };
  for (int i = 0; i < 150; ++i) {
    const Quad q = flat_quad(i % 3, {whole(16), whole(16), whole(16)}, 1 + whole(3), 1 + whole(3));
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), q.corners.begin(), q.corners.end());
    mesh.triangles.insert(mesh.triangles.end(), {{first, first + 1, first + 2}, {first, first + 2, first + 3}});
  }
  append_box(mesh, {{0, 0, 0}, {16, 16, 16}});
  b.add(mesh);
  for (int k = 0; k < 120; ++k) {
    const float x = std::ldexp(1.0F, -k);
    b.add(flat_quad(k % 3, {x, x, x}, x, x));
  }
  const auto scene = b.build();
  std::vector<Ray> rays = rays_in(random, {{0, 0, 0}, {16, 16, 16}}, effort(600, 50'000));
  for (int i = 0; i < effort(600, 50'000); ++i) {  // in the planes, and at the clusters
    Vec3 origin{whole(34) / 2, whole(34) / 2, whole(34) / 2};
    Vec3 d{whole(3) - 1, whole(3) - 1, whole(3) - 1};
    if (i % 3 == 0) {
      const auto near = static_cast<float>(random.magnitude(-30, 0));
      d = Vec3{near * 1.5F, near * 1.25F, near} - origin;
    }
    rays.push_back({origin, d});
  }
  const auto known = known_rays(scene, rays);
  EXPECT_GT(count_hits(known), known.size() / 2);
  for (const AccelOptions& options : accel_choices()) {
    const auto accel = make_accel(scene, options);
    EXPECT_LE(accel->stats().depth, 2 * 96U) << describe(options) << ": of objects and of triangles";
    expect_same_hits(*accel, known, describe(options) + ", on planes");
  }
}

/// Long thin triangles, long cylinders and wide disks through all of a crowd of small ones: what is found in a cell
/// may lie cells away, behind something nearer that is found later.
TEST(StressStructures, PrimitivesThatSpanManyCells_Stress50) {
  for (int seed = 0; seed < effort(3, 60); ++seed) {
    Random random(seed);
    SceneBuilder b;
    TriangleMesh mesh;
    for (int i = 0; i < 500; ++i) {
      const bool is_long = i % 5 == 0;
      const Vec3d a = random.in_cube() * 10;
      const double reach = is_long ? 10 : 0.3;
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      for (const Vec3d p :
           {a, is_long ? random.in_cube() * reach : a + random.in_cube() * reach, a + random.in_cube() * 0.3})
        mesh.positions.push_back(to_float(p));
      mesh.triangles.push_back({first, first + 1, first + 2});
    }
    b.add(mesh);
    for (int i = 0; i < 60; ++i) {
      b.add(Sphere{to_float(random.in_cube() * 10), 0.2F});
      if (i % 6 == 0) b.add(Cylinder{to_float(random.in_cube() * 10), to_float(random.in_cube() * 10), 0.05F});
      if (i % 12 == 0) b.add(Disk{to_float(random.in_cube() * 5), *UnitVec3::normalize(random.direction()), 6});
    }
    const auto scene = b.build();
    const auto known = known_rays(scene, rays_in(random, {{-10, -10, -10}, {10, 10, 10}}, effort(700, 20'000)));
    EXPECT_GT(count_hits(known), known.size() / 3);
    expect_same_hits_everywhere(scene, known, "many cells " + std::to_string(seed));
  }
}

/// Lights alone: background, and no structure.
TEST(StressStructures, OfNothingAreNotBuilt_Stress51) {
  const auto lights = SceneBuilder().light(PointLight{{1, 2, 3}, {4, 5, 6}}).light(AmbientLight{{1, 1, 1}}).build();
  for (const AccelOptions& options : accel_choices()) {
    const auto accel = make_accel(lights, options);
    EXPECT_EQ(accel->stats().nodes, 0U) << describe(options);
    EXPECT_FALSE(accel->closest({{}, {1, 0, 0}})) << describe(options);
    Settings settings;
    settings.accel = options;
    for (const ScreenBounds bounds : {ScreenBounds::flat, ScreenBounds::hierarchical}) {
      settings.screen_bounds = bounds;
      EXPECT_FALSE(needs_structure(make_plan(*lights, mixed_camera(), settings))) << describe(options);
    }
  }
}

}  // namespace
}  // namespace tessera

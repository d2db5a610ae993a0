#include "core/screen/screen_parts.h"

#include <algorithm>
#include <map>
#include <numbers>

#include <gtest/gtest.h>

#include "core/geometry/triangle.h"
#include "core/screen/screen_rect.h"
#include "tests/support/camera_samples.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

constexpr std::uint32_t kSide = 200;
constexpr std::int32_t kSmallest = 8;

std::vector<PixelRect> whole_areas(const Scene& scene, const CameraRays& camera) {
  std::vector<PixelRect> areas;
  for (const Aabb& box : world_bounds(scene)) {
    const auto& placement = scene.objects[areas.size()].placement;
    areas.push_back(screen_rect(box, camera, placement ? placement->error() : Transform::Error{}));
  }
  return areas;
}

std::vector<ScreenPart> parts_of(const Scene& scene, const CameraRays& camera) {
  return screen_parts(scene, camera, whole_areas(scene, camera), kSmallest);
}

CameraRays looking_down_z(Vec3 from = {0, 0, 3}, float fov = 1.0F) {
  return {PerspectiveCamera{{from, from + Vec3{0, 0, -1}, {0, 1, 0}}, fov}, kSide, kSide};
}

bool any_part_has(const std::vector<ScreenPart>& parts, std::uint32_t object, std::int32_t x, std::int32_t y) {
  return std::ranges::any_of(parts, [&](const ScreenPart& p) {
    return p.object == object && x >= p.area.x0 && x < p.area.x1 && y >= p.area.y0 && y < p.area.y1;
  });
}

TEST(ScreenParts, FollowASilhouette) {
  const auto parts = parts_of(*SceneBuilder().add(icosphere(4)).build(), looking_down_z());
  std::vector<bool> seen(std::size_t{kSide} * kSide);
  PixelRect whole = parts[0].area;
  for (const ScreenPart& part : parts) {
    const PixelRect a = part.area;
    whole = {std::min(whole.x0, a.x0), std::min(whole.y0, a.y0), std::max(whole.x1, a.x1), std::max(whole.y1, a.y1)};
    for (std::int32_t y = a.y0; y < a.y1; ++y)
      for (std::int32_t x = a.x0; x < a.x1; ++x) seen[static_cast<std::size_t>(y * int{kSide} + x)] = true;
  }
  const double share = static_cast<double>(std::ranges::count(seen, true)) / static_cast<double>(whole.area());
  EXPECT_GT(share, std::numbers::pi / 4) << "a disk in its square";
  EXPECT_LT(share, 0.9);
}

TEST(ScreenParts, OfWhatIsNoMeshOrSmallOrBehindAreTheObject) {
  SceneBuilder b;
  b.add(Sphere{{0, 0, 0}, 1}).add(icosphere(3, 0.01F)).add(icosphere(3, 1, {0, 0, 9}));
  const auto scene = b.build();
  const auto parts = parts_of(*scene, looking_down_z());
  const auto areas = whole_areas(*scene, looking_down_z());
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].area, areas[0]);
  EXPECT_EQ(parts[1].area, areas[1]);
}

TEST(ScreenParts, AreLimitedForTheSceneAsAWhole) {
  const TriangleMesh mesh = icosphere(5);
  for (const int side : {1, 10, 60}) {
    SceneBuilder b;
    const auto shape = b.shape(mesh);
    for (int i = 0; i < side * side; ++i)
      b.place(shape, 0, placed({1, 0, 0, 0.1 * (i % side), 0, 1, 0, 0.1 * (i / side), 0, 0, 1, 0}));  // NOLINT
    const auto parts = parts_of(*b.build(), looking_down_z({3, 3, 20}));
    std::map<std::uint32_t, std::size_t> of_object;
    for (const ScreenPart& part : parts) ++of_object[part.object];
    const auto objects = static_cast<std::size_t>(side * side);
    EXPECT_EQ(of_object.size(), objects);
    EXPECT_LE(parts.size(), std::max<std::size_t>(kMostParts, objects));
    EXPECT_GT(parts.size(), objects) << "each is divided";
    for (const auto& [object, count] : of_object) EXPECT_EQ(count, of_object[0]) << "evenly";
  }
}

TEST(ScreenParts, OfADegenerateMeshAreFew) {
  // All triangles in one point of the grid, on a line, and with extents that have no float reciprocal.
  TriangleMesh twins, needle, denormal;
  twins.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
  twins.triangles.assign(5000, {0, 1, 2});
  for (int i = 0; i < 1000; ++i) needle.positions.push_back({static_cast<float>(i) * 1e-3F, 0, 0});
  for (std::uint32_t i = 0; i + 2 < 1000; ++i) needle.triangles.push_back({i, i + 1, i + 2});
  denormal = icosphere(3, 1e-40F);
  const CameraRays near(PerspectiveCamera{{{0, 0, 1e-38F}, {0, 0, 0}, {0, 1, 0}}, 1}, kSide, kSide);
  EXPECT_EQ(parts_of(*SceneBuilder().add(twins).build(), looking_down_z()).size(), 1U);
  EXPECT_LE(parts_of(*SceneBuilder().add(needle).build(), looking_down_z()).size(), 16U);
  EXPECT_GE(parts_of(*SceneBuilder().add(denormal).build(), near).size(), 1U);
}

/// What samples about the scene's triangles meet, tested one by one, lies in a part; parts lie in the whole's area.
/// Returns how many samples met something.
int expect_superset(const Scene& scene, const CameraRays& camera, Random& random, int seed) {
  const auto areas = whole_areas(scene, camera);
  const auto parts = screen_parts(scene, camera, areas, kSmallest);
  for (const ScreenPart& part : parts) EXPECT_EQ(intersect(part.area, areas[part.object]), part.area);
  int hits = 0;
  for (int i = 0; i < 40; ++i) {
    // Aim at corners and edges, where the answer is hard; the sample falls anywhere, as with jitter.
    const auto target = static_cast<std::uint32_t>(random.bits() % scene.objects.size());
    const Object& aimed = scene.objects[target];
    const auto& mesh = std::get<TriangleMesh>(scene.shapes[aimed.shape]);
    const TriangleIndices& t = mesh.triangles[random.bits() % mesh.triangles.size()];
    const double along = i % 3 == 0 ? 0 : random.uniform(0, 1);
    const Vec3d p = to_double(mesh.positions[t[0]]) * (1 - along) + to_double(mesh.positions[t[1]]) * along;
    const auto [x, y, ray] = sample_toward(camera, aimed.placement ? aimed.placement->point_to_world(p) : p, random);
    for (std::uint32_t o = 0; o < scene.objects.size(); ++o) {
      const Object& object = scene.objects[o];
      const auto& tested = std::get<TriangleMesh>(scene.shapes[object.shape]);
      const Ray local = object.placement ? object.placement->to_local(ray) : ray;
      const TriangleRay sheared(local);
      const bool hit = std::ranges::any_of(tested.triangles, [&](const TriangleIndices& k) {
        return intersect_triangle(sheared, tested.positions[k[0]], tested.positions[k[1]], tested.positions[k[2]])
            .has_value();
      });
      if (!hit) continue;
      ++hits;
      EXPECT_TRUE(any_part_has(parts, o, x, y)) << "seed " << seed << " object " << o << " at " << x << " " << y;
    }
  }
  return hits;
}

/// A ball's mesh, and an instance of it, about the camera, before it, behind it, or across its plane.
std::shared_ptr<const Scene> two_meshes(Random& random, double size) {
  SceneBuilder b;
  const auto shape =
      b.shape(icosphere(3, static_cast<float>(size * random.magnitude(-3, 0.5)), to_float(random.in_cube() * size)));
  std::array<double, 12> rows{};
  for (double& v : rows) v = random.uniform(-1.5, 1.5);
  for (const std::size_t i : {3, 7, 11}) rows[i] *= size;
  return b.place(shape).place(shape, 0, Transform::from_rows(rows)).build();
}

TEST(ScreenParts, HoldWhatEverySampleMeets_Stress38_Stress39_Stress40_Stress41_Stress42) {
  int hits = 0;
  for (int seed = 0; seed < 1000; ++seed) {
    Random random(static_cast<std::uint64_t>(seed));
    const double size = random.magnitude(-3, 4);
    const auto scene = two_meshes(random, size);
    const Vec3 corner = std::get<TriangleMesh>(scene->shapes[0]).positions[0];
    const CameraRays camera(any_camera(random, size, corner, kSide), kSide, kSide, seed % 2 == 0 ? 0 : 1.75);
    hits += expect_superset(*scene, camera, random, seed);
  }
  EXPECT_GT(hits, 10'000);
}

TEST(ScreenParts, CoverTheScreenFromInside_Stress38) {
  const auto parts = parts_of(*SceneBuilder().add(icosphere(4)).build(), looking_down_z({0.1F, 0.2F, 0.1F}));
  for (std::int32_t y = 0; y < int{kSide}; ++y)
    for (std::int32_t x = 0; x < int{kSide}; ++x) ASSERT_TRUE(any_part_has(parts, 0, x, y)) << x << " " << y;
}

}  // namespace
}  // namespace tessera

// Promise 5, STRESS 10–14 and 21: no ray passes between triangles that share an edge or a vertex, in any structure.
#include <gtest/gtest.h>

#include "tests/property/closed_meshes.h"
#include "tests/support/effort.h"
#include "tests/support/same_hits.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

/// Every choice for small meshes. The ordinary run tries larger ones in each kind of structure once, and in a hierarchy
/// of each bound, and in a BSP, while that is quick to build.
std::vector<AccelOptions> choices_for(const TriangleMesh& mesh) {
  constexpr std::size_t kSmall = 1500, kMedium = 6000, kLarge = 15'000;
  std::vector<AccelOptions> choices = accel_choices();
  const std::size_t triangles = mesh.triangles.size();
  if (triangles <= kSmall || long_tests()) return choices;
  std::erase_if(choices, [&](const AccelOptions& o) {
    if (o.kind == AccelKind::bsp && triangles > kMedium) return true;
    if (o.kind == AccelKind::bvh && o.space == BoundSpace::world)
      return triangles > kLarge && o.bound != BoundKind::box;
    return o != AccelOptions{o.kind};
  });
  return choices;
}

/// Brute force takes so few rays of a large mesh that it isn't worth its time.
std::size_t rays_for(const AccelOptions& options, const TriangleMesh& mesh, std::size_t rays) {
  if (options.kind != AccelKind::brute || long_tests()) return rays;
  return std::min(rays, 10'000'000 / mesh.triangles.size());
}

/// Every ray starts where a closed surface goes round it.
void expect_no_leaks(const TriangleMesh& mesh, const std::shared_ptr<const Scene>& scene, const std::vector<Ray>& rays,
                     const std::string& what) {
  ASSERT_FALSE(rays.empty()) << what;
  for (const AccelOptions& options : choices_for(mesh)) {
    const auto accel = make_accel(scene, options);
    const std::size_t count = rays_for(options, mesh, rays.size());
    std::size_t leaks = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Ray& ray = rays[i * rays.size() / count];
      leaks += !accel->closest(ray) || !accel->occluded(ray);
    }
    EXPECT_EQ(leaks, 0U) << "of " << count << ", " << what << ", " << describe(options);
  }
}

void expect_no_leaks(const TriangleMesh& mesh, const std::vector<Ray>& rays, const std::string& what) {
  expect_no_leaks(mesh, SceneBuilder().add(mesh).build(), rays, what);
}

std::vector<Ray> random_rays(const std::vector<Vec3>& origins, Random& random, int count) {
  std::vector<Ray> rays;
  if (!origins.empty())
    for (int i = 0; i < count; ++i)
      rays.push_back({origins[random.bits() % origins.size()], to_float(random.direction())});
  return rays;
}

/// At every vertex and every middle of an edge, or at `most` of them.
std::vector<Ray> aimed_rays(const TriangleMesh& mesh, const std::vector<Vec3>& origins, Random& random, int most) {
  std::vector<Vec3> targets;
  for (const auto& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 a = mesh.positions[t[i]], b = mesh.positions[t[(i + 1) % 3]];
      if (t[i] < t[(i + 1) % 3]) targets.push_back((a + b) * 0.5F);
      if (t[i] < t[(i + 1) % 3] && t[i] < t[(i + 2) % 3]) targets.push_back(a);
    }
  std::vector<Ray> rays;
  const std::size_t count = std::min(targets.size(), static_cast<std::size_t>(most));
  for (std::size_t i = 0; i < count && !origins.empty(); ++i) {
    const Vec3 target = targets[i * targets.size() / count], origin = origins[random.bits() % origins.size()];
    if (target != origin) rays.push_back({origin, target - origin});
  }
  return rays;
}

std::vector<Ray> all_rays(const TriangleMesh& mesh, Random& random) {
  const auto origins = points_inside(mesh, random, static_cast<std::size_t>(effort(20, 100)));
  std::vector<Ray> rays = random_rays(origins, random, effort(1000, 1'000'000));
  const auto aimed = aimed_rays(mesh, origins, random, effort(2000, 10'000'000));
  rays.insert(rays.end(), aimed.begin(), aimed.end());
  return rays;
}

void expect_closed_from_inside(const std::vector<ClosedMesh>& meshes) {
  for (const auto& [name, mesh] : meshes) {
    Random random(10);
    expect_no_leaks(mesh, all_rays(mesh, random), name);
  }
}

TEST(Watertight, MadeMeshesFromInside_Stress10_Stress11) { expect_closed_from_inside(made_closed_meshes()); }

TEST(Watertight, SharedMeshesFromInside_Stress10_Stress11) {
  const auto meshes = shared_closed_meshes();
  if (meshes.empty()) GTEST_SKIP() << "the closed meshes are not beside this checkout (shared/data/meshes)";
  expect_closed_from_inside(meshes);
}

constexpr Vec3 kFarAway{148376, 1234, -223423};

/// Moved vertex by vertex, to the floats there are that far out (a mesh of less than a few hundredths then is nothing
/// that goes round a point any more), and moved as an instance.
void expect_closed_far_away(const std::vector<ClosedMesh>& meshes) {
  for (const auto& [name, mesh] : meshes) {
    if (mesh.triangles.size() > 100'000 && !long_tests()) continue;  // takes longer than all others together
    Random random(12);
    if (length(to_double(bounds(mesh).diagonal())) > 1) {
      TriangleMesh moved = mesh;
      for (Vec3& p : moved.positions) p = p + kFarAway;
      expect_no_leaks(moved, all_rays(moved, random), name + " moved");
    }

    SceneBuilder b;
    b.place(b.shape(mesh), 0, placed({1, 0, 0, kFarAway.x, 0, 1, 0, kFarAway.y, 0, 0, 1, kFarAway.z}));
    const auto scene = b.build();
    std::vector<Vec3> origins;
    for (int tries = 0; tries < 400 && origins.size() < 20; ++tries) {
      const Vec3d p = random.in_cube();
      const Vec3 half = bounds(mesh).diagonal() * 0.5F;
      const Vec3 at = bounds(mesh).center() + to_float({p.x * half.x, p.y * half.y, p.z * half.z}) + kFarAway;
      if (std::abs(winding_number(mesh, scene->objects[0].placement->to_local({at, {1, 0, 0}}).origin)) > 0.9)
        origins.push_back(at);
    }
    expect_no_leaks(mesh, scene, random_rays(origins, random, effort(500, 1'000'000)), name + " as an instance");
  }
}

TEST(Watertight, MadeMeshesFarAway_Stress12) { expect_closed_far_away(made_closed_meshes()); }

TEST(Watertight, SharedMeshesFarAway_Stress12) {
  const auto meshes = shared_closed_meshes();
  if (meshes.empty()) GTEST_SKIP() << "the closed meshes are not beside this checkout (shared/data/meshes)";
  expect_closed_far_away(meshes);
}

/// Rays through edges and vertices of the grid, straight and slanted.
std::vector<Ray> rays_at(const TriangleMesh& grid, Random& random, int count) {
  std::vector<Ray> rays;
  for (int i = 0; i < count; ++i) {
    const auto& t = grid.triangles[random.bits() % grid.triangles.size()];
    const std::size_t corner = random.bits() % 3;
    const Vec3 a = grid.positions[t[corner]], b = grid.positions[t[(corner + 1) % 3]];
    const Vec3 target = i % 3 == 0 ? a : (a + b) * 0.5F;
    const bool on_rim = std::abs(target.x) == 1 || std::abs(target.y) == 1;  // beyond which there is nothing to hit
    const Vec3 origin =
        i % 2 == 0 || on_rim ? target + Vec3{0, 0, 1} : to_float(random.in_cube() * 0.9) + Vec3{0, 0, 2};
    rays.push_back({origin, target - origin});
  }
  return rays;
}

/// At least one hit, and of those at equal t the same one everywhere.
TEST(Watertight, AcrossAnAxisAlignedGrid_Stress13) {
  for (const std::uint32_t n : {20U, 200U}) {
    const TriangleMesh mesh = grid_plane(n);
    const auto scene = SceneBuilder().add(mesh).build();
    Random random(13);
    // Brute force has the time for some of the rays; a hierarchy that agrees with it there stands in for the rest.
    const std::vector<Ray> rays = rays_at(mesh, random, effort(3000, 1'000'000));
    const auto box_tree = make_accel(scene, {AccelKind::bvh});
    std::vector<KnownRay> known;
    for (const Ray& ray : rays) known.push_back({ray, box_tree->closest(ray)});
    EXPECT_EQ(count_hits(known), known.size()) << "leaks";
    std::vector<KnownRay> some;
    for (std::size_t i = 0; i < known.size(); i += known.size() / 100) some.push_back(known[i]);
    for (const AccelOptions& options : choices_for(mesh))
      expect_same_hits(*make_accel(scene, options), options.kind == AccelKind::brute ? some : known, describe(options));
  }
}

TEST(Watertight, AGlobeFromNearItsCentre_Stress14) {
  for (const double radius : {1.0, 2.7, 6.0}) {
    const TriangleMesh mesh = globe(16, 16, radius);
    Random random(14);
    std::vector<Vec3> origins;
    while (origins.size() < 1000) {
      const Vec3d p = random.in_cube() * 0.5;
      if (length(p) <= 0.5) origins.push_back(to_float(p));
    }
    std::vector<Ray> rays = random_rays(origins, random, effort(1000, 100'000));
    for (int i = 0; i < effort(1000, 100'000); ++i) {
      const Vec3 origin = origins[random.bits() % origins.size()];
      rays.push_back({origin, mesh.positions[random.bits() % mesh.positions.size()] - origin});
    }
    expect_no_leaks(mesh, rays, "globe of " + std::to_string(radius));
  }
}

/// So far out that vertices fall on the few floats there are: the mesh that they make is closed still.
TEST(Watertight, QuantisedMeshes_Stress21) {
  for (const double offset : {1e6, 1e7, 1e8}) {
    TriangleMesh mesh = icosphere(3, 150);
    for (Vec3& p : mesh.positions) p = to_float(to_double(p) + Vec3d{-0.6, 1, 0.3} * offset);
    Random random(21);
    expect_no_leaks(mesh, all_rays(mesh, random), "offset " + std::to_string(offset));
  }
}

}  // namespace
}  // namespace tessera

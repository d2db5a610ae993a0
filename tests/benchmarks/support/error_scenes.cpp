#include "tests/benchmarks/support/error_scenes.h"

#include "tests/benchmarks/support/terrain.h"
#include "tests/support/scenes.h"

namespace tessera::bench {
namespace {

constexpr int kRays = 2000;

Ray towards(Vec3 from, Vec3 at) { return {from, at - from}; }

/// From all around, at points within.
std::vector<Ray> rays_around(Vec3d center, double size, std::uint64_t seed) {
  Random random(seed);
  std::vector<Ray> rays;
  for (int i = 0; i < kRays; ++i)
    rays.push_back(
        towards(to_float(center + random.direction() * (4 * size)), to_float(center + random.in_cube() * size)));
  return rays;
}

/// At vertices and at the middles of edges, where the triangles of a closed mesh must not leave a gap.
std::vector<Ray> rays_at_edges(const TriangleMesh& mesh, double distance) {
  Random random(1);
  std::vector<Ray> rays;
  for (int i = 0; i < kRays; ++i) {
    const auto& [a, b, c] = mesh.triangles[random.bits() % mesh.triangles.size()];
    const Vec3 p = mesh.positions[a], q = mesh.positions[b];
    rays.push_back(towards(to_float(random.direction() * distance), i % 2 == 0 ? p : (p + q) * 0.5F));
  }
  return rays;
}

/// Almost along the ground, from one side of it to the other.
std::vector<Ray> rays_along_the_ground() {
  Random random(2);
  std::vector<Ray> rays;
  for (int i = 0; i < kRays; ++i) {
    const auto height = [&] { return static_cast<float>(random.uniform(-0.25, 0.25)); };
    const auto across = [&] { return static_cast<float>(random.uniform(0, 1)); };
    rays.push_back(towards({-1, height(), across()}, {2, height(), across()}));
  }
  return rays;
}

/// A hundred thousand times as long as wide, lying anyhow.
TriangleMesh needles() {
  Random random(3);
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < 3 * 2000; i += 3) {
    const Vec3d tip = random.in_cube(), along = random.direction(), aside = random.direction() * 1e-5;
    for (const Vec3d p : {tip - along, tip + along, tip + along + aside}) mesh.positions.push_back(to_float(p));
    mesh.triangles.push_back({i, i + 1, i + 2});
  }
  return mesh;
}

/// Each at a point of one of the needles: a ray anywhere else meets none.
std::vector<Ray> rays_at_needles(const TriangleMesh& mesh) {
  Random random(4);
  std::vector<Ray> rays;
  for (int i = 0; i < kRays; ++i) {
    const auto& [a, b, c] = mesh.triangles[random.bits() % mesh.triangles.size()];
    const double u = random.uniform(0, 1), v = random.uniform(0, 1 - u);
    const Vec3d at = to_double(mesh.positions[a]) * (1 - u - v) + to_double(mesh.positions[b]) * u +
                     to_double(mesh.positions[c]) * v;
    rays.push_back(towards(to_float(random.direction() * 5), to_float(at)));
  }
  return rays;
}

std::shared_ptr<const Scene> of(Shape shape) { return SceneBuilder().add(std::move(shape)).build(); }

}  // namespace

std::vector<ErrorScene> error_scenes() {
  const TriangleMesh ball = icosphere(3), thin = needles();
  constexpr Vec3 kFar{1e6F, -1e6F, 1e6F};
  return {
      {"ball", "1280 triangles, rays from around", of(ball), rays_around({}, 1, 5)},
      {"edges", "the same, rays at vertices and edges", of(ball), rays_at_edges(ball, 4)},
      {"inside", "the same, from within", of(ball), rays_at_edges(ball, 0.5)},
      {"far", "the same, 100 m wide, 10⁶ m from the origin", of(icosphere(3, 50, kFar)),
       rays_around(to_double(kFar), 50, 6)},
      {"tiny", "the same, a nanometre wide", of(icosphere(3, 5e-10F)), rays_around({}, 5e-10, 7)},
      {"needles", "2000 triangles 10⁵ times as long as wide", of(thin), rays_at_needles(thin)},
      {"grazing", "hills of 4000 triangles, rays along the ground", of(terrain(4000)), rays_along_the_ground()},
      {"quadrics", "200 shapes of every kind, some of them placed", random_scene(8, 200), rays_around({}, 10, 9)},
  };
}

}  // namespace tessera::bench

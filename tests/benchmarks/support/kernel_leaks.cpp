#include "tests/benchmarks/support/kernel_leaks.h"

#include <algorithm>
#include <memory>
#include <span>

#include "tests/benchmarks/support/embree_peer.h"
#include "tests/benchmarks/support/kernel_meshes.h"
#include "tests/support/meshes.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"

namespace tessera::bench {
namespace {

constexpr int kOrigins = 6;
constexpr double kInsideRadius = 0.1;

/// Of a closed mesh each edge belongs to two triangles, in which it runs in opposite directions.
std::vector<Vec3> middles_of_edges(const TriangleMesh& mesh) {
  std::vector<Vec3> middles;
  for (const TriangleIndices& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i)
      if (const std::uint32_t a = t[i], b = t[(i + 1) % 3]; a < b)
        middles.push_back((mesh.positions[a] + mesh.positions[b]) * 0.5F);
  return middles;
}

/// The origins' rays, one origin after the other.
std::vector<Ray> rays_from_inside(const std::vector<Vec3>& targets) {
  Random random(1);
  std::vector<Ray> rays;
  for (int i = 0; i < kOrigins; ++i) {
    const Vec3 origin = to_float(random.in_cube() * kInsideRadius);
    for (const Vec3& target : targets) rays.push_back({origin, target - origin});
  }
  return rays;
}

std::size_t leaks_of_ours(const Accel& accel, std::span<const Ray> rays) {
  const std::size_t fan = rays.size() / kOrigins;
  std::vector<Hit> hits(rays.size()), fan_hits(rays.size());
  std::vector<std::uint8_t> hidden(rays.size());
  accel.closest(rays, hits);
  accel.occluded(rays, hidden);
  for (std::size_t at = 0; at < rays.size(); at += fan) {
    Directions directions;
    directions.append_those_of(rays.subspan(at, fan));
    accel.closest_fan({rays[at].origin, directions}, std::span(fan_hits).subspan(at, fan));
  }
  std::size_t leaks = 0;
  for (std::size_t i = 0; i < rays.size(); ++i)
    leaks += !(hits[i].t < kInfinity && fan_hits[i].t < kInfinity && hidden[i] != 0);
  return leaks;
}

std::optional<std::size_t> leaks_of_embree(const TriangleMesh& mesh, EmbreeScenes scenes, std::span<const Ray> rays) {
  const auto build = prepare_embree(mesh, scenes, 1);
  if (!build) return std::nullopt;
  const auto scene = build->build();
  const auto packed = make_embree_rays(1, false);
  packed->pack(rays);
  packed->trace(*scene, false);
  std::vector<float> t(rays.size());
  packed->answers(t);
  return static_cast<std::size_t>(std::ranges::count(t, kInfinity));
}

}  // namespace

std::vector<LeakCount> count_leaks(const AccelOptions& accel) {
  std::vector<LeakCount> counts;
  const auto add = [&](const std::string& name, const TriangleMesh& mesh) {
    const auto ours = make_accel(SceneBuilder().add(mesh).build(), accel);
    const auto aim = [&](const std::string& aimed_at, const std::vector<Vec3>& targets) {
      const std::vector<Ray> rays = rays_from_inside(targets);
      counts.push_back({name, aimed_at, rays.size(), leaks_of_ours(*ours, rays),
                        leaks_of_embree(mesh, EmbreeScenes::normal, rays),
                        leaks_of_embree(mesh, EmbreeScenes::robust, rays)});
    };
    aim("vertices", mesh.positions);
    aim("middles of edges", middles_of_edges(mesh));
  };
  add("icosphere", icosphere(5));
  add("organic_100k", organic(100'000));
  return counts;
}

}  // namespace tessera::bench

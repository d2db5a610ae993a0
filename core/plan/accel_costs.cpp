#include "core/plan/accel_costs.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "core/accel/accel_table.h"

namespace tessera {
namespace {

/// Items of one index: the objects of a scene, or the triangles of a mesh.
struct Level {
  double items = 0;
  double test_ns = 0;   ///< Of one item.
  double crowding = 1;  ///< How many items share the grid cell of an item, on average over the items.
  double visits = 1;    ///< How often a ray comes to walk it.
};

constexpr double kTriangleTest = 16, kObjectTest = 30, kVolumeTest = 9;
constexpr double kRay = 20;    ///< Of a ray, whatever it meets.
constexpr double kSetUp = 20;  ///< Of a ray, for one index.

/// Build and walk of one kind over one level, in nanoseconds.
struct Cost {
  double build;
  double walk;
};

double log2_of(double items) { return std::log2(items + 1); }

/// A hierarchy of boxes, against which the other trees are told.
Cost tree_of_boxes(const Level& level) {
  return {48 * level.items * log2_of(level.items), kSetUp + 18 * log2_of(level.items) + level.test_ns};
}

/// A bound an object, or √n bounds of √n triangles each, of which a ray enters one or two.
Cost flat_list(const Level& level, bool of_primitives) {
  const double groups = of_primitives ? std::sqrt(level.items) : level.items;
  const double tests = of_primitives ? 1.2 * groups : 2;
  return {20 * level.items * log2_of(level.items), 2 * kSetUp + kVolumeTest * groups + tests * level.test_ns};
}

Cost cost_of(AccelKind kind, const Level& level, bool of_primitives) {
  const Cost tree = tree_of_boxes(level);
  switch (kind) {
    case AccelKind::brute:
      return {0, level.items * level.test_ns};
    case AccelKind::bounds:
      return flat_list(level, of_primitives);
    case AccelKind::grid:
      return {700 * level.items, 3 * kSetUp + 16 * std::cbrt(level.items) + level.crowding * level.test_ns};
    case AccelKind::octree:
      return {1000 * level.items, tree.walk * 1.4 + std::sqrt(level.crowding) * level.test_ns};
    case AccelKind::kd:
      return {8 * tree.build, tree.walk * 1.1};
    case AccelKind::bsp:
      return {50'000 * level.items, tree.walk * 1.2};
    default:
      return tree;
  }
}

/// How much more than boxes a bound costs to build and to clip, its tighter fit included.
struct BoundFactors {
  double build, walk;
};
BoundFactors factors(BoundKind bound) {
  switch (bound) {
    case BoundKind::sphere:
      return {7, 2.4};
    case BoundKind::slabs:
      return {2.5, 1.6};
    case BoundKind::hull:
      return {25, 3.5};
    default:
      return {1, 1};
  }
}

/// The mean over items of how many lie in the same cell of a grid with four cells an item; of a sample of the items,
/// for which the same holds.
double crowding_of(const std::vector<Vec3>& sample) {
  Aabb box;
  for (const Vec3 p : sample) box.extend(p);
  const Vec3d extent = to_double(box.hi) - to_double(box.lo);
  const double volume = extent.x * extent.y * extent.z;
  if (sample.empty() || !(volume > 0) || !std::isfinite(volume)) return 1;
  const double side = std::cbrt(volume / (4 * static_cast<double>(sample.size())));
  std::unordered_map<std::uint64_t, double> cells;
  for (const Vec3 p : sample) {
    std::uint64_t cell = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double along = std::min((static_cast<double>(p[axis]) - box.lo[axis]) / side, double{1 << 20});
      cell = cell << 21 | static_cast<std::uint64_t>(along);
    }
    ++cells[cell];
  }
  double squares = 0;
  for (const auto& [cell, count] : cells) squares += count * count;
  return squares / static_cast<double>(sample.size());
}

constexpr std::size_t kSample = 4096;

/// Every n-th of `count` things, `kSample` of them at most.
template <typename At>
std::vector<Vec3> sample_of(std::size_t count, At&& at) {
  std::vector<Vec3> sample;
  const std::size_t step = count / kSample + 1;
  for (std::size_t i = 0; i < count; i += step) sample.push_back(at(i));
  return sample;
}

Level mesh_level(const TriangleMesh& mesh, double visits) {
  const auto centre = [&](std::size_t i) {
    const TriangleIndices& t = mesh.triangles[i];
    return (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) * (1 / 3.0F);
  };
  const std::size_t count = mesh.triangles.size();
  return {static_cast<double>(count), kTriangleTest, crowding_of(sample_of(count, centre)), visits};
}

struct Levels {
  Level objects;
  std::vector<Level> meshes;
};

/// A ray through the scene's box enters an object's with the share that the object's surface has of the scene's; what
/// hides behind others is seldom reached, so a ray comes to a few objects at most.
Levels levels_of(const Scene& scene) {
  constexpr double kMostVisits = 3;
  const std::vector<Aabb> boxes = world_bounds(scene);
  Aabb all;
  for (const Aabb& box : boxes) all.extend(box);
  std::vector<double> visits(scene.shapes.size(), 0);
  double sum = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const double share = half_area(all) > 0 ? half_area(boxes[i]) / half_area(all) : 1;
    visits[scene.objects[i].shape] += share;
    sum += share;
  }
  const double scale = sum > kMostVisits ? kMostVisits / sum : 1;
  Levels levels;
  const auto centre = [&](std::size_t i) { return boxes[i].center(); };
  levels.objects = {static_cast<double>(boxes.size()), kObjectTest, crowding_of(sample_of(boxes.size(), centre)), 1};
  for (std::size_t i = 0; i < scene.shapes.size(); ++i)
    if (const auto* mesh = std::get_if<TriangleMesh>(&scene.shapes[i]); mesh && visits[i] > 0)
      levels.meshes.push_back(mesh_level(*mesh, visits[i] * scale));
  return levels;
}

AccelEstimate estimate(const AccelOptions& options, const Levels& levels, double rays) {
  const bool builds = options.kind != AccelKind::brute;
  const Cost objects = cost_of(options.kind, levels.objects, false);
  double build = objects.build, walk = kRay + objects.walk;
  for (const Level& mesh : levels.meshes) {
    const Cost cost = cost_of(options.kind, mesh, true);
    build += cost.build;
    // Without bounds every ray comes to every mesh.
    walk += cost.walk * (builds ? mesh.visits : std::max(mesh.visits, 1.0));
  }
  const BoundFactors bound = factors(options.bound);
  return {options, build * bound.build * 1e-9, walk * bound.walk * rays * 1e-9};
}

}  // namespace

std::vector<AccelEstimate> estimate_accels(const Scene& scene, double rays) {
  const Levels levels = levels_of(scene);
  std::vector<AccelEstimate> estimates;
  for (const AccelEntry& row : accel_table()) {
    const bool has_bounds = std::ranges::find(row.options, "bound") != row.options.end();
    for (const BoundKind bound : {BoundKind::box, BoundKind::sphere, BoundKind::slabs, BoundKind::hull})
      if (bound == BoundKind::box || has_bounds)
        estimates.push_back(estimate(AccelOptions{row.kind, bound}, levels, rays));
  }
  std::ranges::stable_sort(estimates, {}, &AccelEstimate::total_seconds);
  return estimates;
}

}  // namespace tessera

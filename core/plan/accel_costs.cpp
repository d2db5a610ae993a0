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
  double test_ns = 0;               ///< Of one item.
  double crowding = 1;              ///< How many items share the grid cell of an item, on average over the items.
  double boxes_met = 1;             ///< Items whose box a ray through the whole passes.
  double cells_met = 1;             ///< Items whose cells it passes, where cells are small.
  double visits = 1;                ///< How often a ray comes to walk it.
  double alike = 1;                 ///< Levels that it stands for, itself counted.
  bool is_few_with_meshes = false;  ///< Objects: few, and some of them large meshes.
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

/// What a ray pays for items that it meets but doesn't hit. A few are met in any mesh, and stand in the rest of the
/// walk.
double detours(const Level& level, double met) {
  constexpr double kUsual = 4;
  return std::max(0.0, met - kUsual) * (2 * kVolumeTest + level.test_ns);
}

/// A tree over anything, but for detours: what trees differ in is told against it.
Cost tree_of(const Level& level) {
  return {48 * level.items * log2_of(level.items), kSetUp + 18 * log2_of(level.items) + level.test_ns};
}

/// A bound an object, or √n bounds of √n triangles each, of which a ray enters one or two.
Cost flat_list(const Level& level, bool of_primitives) {
  const double groups = of_primitives ? std::sqrt(level.items) : level.items;
  const double tests = of_primitives ? 1.2 * groups : 2;
  return {20 * level.items * log2_of(level.items), 2 * kSetUp + kVolumeTest * groups + tests * level.test_ns};
}

Cost cost_of(AccelKind kind, const Level& level, bool of_primitives) {
  const Cost tree = tree_of(level);
  const double beside_boxes = detours(level, level.boxes_met), beside_cells = detours(level, level.cells_met);
  switch (kind) {
    case AccelKind::brute:
      return {0, level.items * level.test_ns};
    case AccelKind::bounds:
      return flat_list(level, of_primitives);
    case AccelKind::grid:
      return {700 * level.items,
              3 * kSetUp + 16 * std::cbrt(level.items) + level.crowding * level.test_ns + beside_cells};
    case AccelKind::octree:
      return {1000 * level.items, tree.walk * 1.4 + std::sqrt(level.crowding) * level.test_ns + beside_cells};
    case AccelKind::kd:
      return {8 * tree.build, tree.walk * 1.1 + beside_cells};
    case AccelKind::bsp:
      return {50'000 * level.items, tree.walk * 1.2 + beside_cells};
    case AccelKind::wide:
      // Triangles are what it is wide over; it is a tree of boxes over objects, but goes through few of them with whole
      // batches, which pays where some are meshes. A third: rays at large. Whole tiles of camera and shadow rays cost
      // less, a few rays into each of many small meshes more. Long triangles are split. Scenes of quadrics alone take
      // 0.87 to 1.05 times as long as in a binary tree by `tests/bench structures`, whole jobs with their tiles less.
      if (!of_primitives) return {tree.build, (tree.walk + beside_boxes) * (level.is_few_with_meshes ? 1.0 / 3 : 0.85)};
      return {300 * level.items, kSetUp + (tree.walk + std::min(beside_boxes, beside_cells)) / 3};
    default:
      break;
  }
  return {tree.build, tree.walk + beside_boxes};
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

/// Some of the items of a level, each standing for `weight` of them.
struct Sample {
  struct Item {
    Aabb box;
    double half_surface;  ///< Of the item itself, both sides: at most that of its box.
  };
  std::vector<Item> items;
  double weight = 1;
};

/// Every n-th of `count` items, some thousands of them at most.
template <typename At>
Sample sample_of(std::size_t count, At&& at) {
  constexpr std::size_t kMost = 4096;
  const std::size_t step = count / kMost + 1;
  Sample sample;
  for (std::size_t i = 0; i < count; i += step) sample.items.push_back(at(i));
  if (count > 0) sample.weight = static_cast<double>(count) / static_cast<double>(sample.items.size());
  return sample;
}

Aabb box_of(const Sample& sample) {
  Aabb box;
  for (const Sample::Item& item : sample.items) box.extend(item.box);
  return box;
}

/// How many items share the cell of an item, on average, in a grid with four cells an item: as the sample tells.
double crowding_of(const Sample& sample, const Aabb& all, double side) {
  side *= std::cbrt(sample.weight);
  std::unordered_map<std::uint64_t, double> cells;
  for (const Sample::Item& item : sample.items) {
    std::uint64_t cell = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double along = (static_cast<double>(item.box.center()[axis]) - all.lo[axis]) / side;
      cell = cell << 21 | static_cast<std::uint64_t>(std::clamp(along, 0.0, double{1 << 20}));
    }
    ++cells[cell];
  }
  double squares = 0;
  for (const auto& [cell, count] : cells) squares += count * count;
  return squares / static_cast<double>(sample.items.size());
}

/// What the sizes and places of items make of a level. A ray through a convex body meets another one inside it with the
/// share that its surface has (Crofton); cells around a flat or thin item have hardly more surface than it itself.
Level level_of(const Sample& sample, double test_ns, double visits) {
  Level level;
  level.items = sample.weight * static_cast<double>(sample.items.size());
  level.test_ns = test_ns;
  level.visits = visits;
  const Aabb all = box_of(sample);
  const Vec3d extent = to_double(all.hi) - to_double(all.lo);
  const double side = std::cbrt(extent.x * extent.y * extent.z / (4 * level.items)), surface = half_area(all);
  if (sample.items.empty() || !(side > 0) || !std::isfinite(surface)) return level;
  level.crowding = crowding_of(sample, all, side);
  level.boxes_met = level.cells_met = 0;
  for (const auto& [box, half_surface] : sample.items) {
    const double in_box = half_area(box) / surface;
    const double longest = max_component(to_double(box.hi) - to_double(box.lo));
    level.boxes_met += sample.weight * in_box;
    level.cells_met += sample.weight * std::min(in_box, (half_surface + longest * side) / surface);
  }
  return level;
}

Level mesh_level(const TriangleMesh& mesh, double visits) {
  const auto item = [&](std::size_t i) {
    const TriangleIndices& t = mesh.triangles[i];
    const Vec3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
    Sample::Item out{{}, length(cross(to_double(b) - to_double(a), to_double(c) - to_double(a))) / 2};
    for (const Vec3 corner : {a, b, c}) out.box.extend(corner);
    return out;
  };
  return level_of(sample_of(mesh.triangles.size(), item), kTriangleTest, visits);
}

struct Levels {
  Level objects;
  std::vector<Level> meshes;
};

/// The meshes that rays come to; of many, some that stand for all.
std::vector<Level> mesh_levels(const Scene& scene, const std::vector<double>& visits) {
  constexpr std::size_t kMost = 64;
  std::vector<std::size_t> meshes;
  for (std::size_t i = 0; i < scene.shapes.size(); ++i)
    if (visits[i] > 0 && std::holds_alternative<TriangleMesh>(scene.shapes[i])) meshes.push_back(i);
  const std::size_t step = (meshes.size() + kMost - 1) / kMost;
  std::vector<Level> levels;
  for (std::size_t i = 0; i < meshes.size(); i += step)
    levels.push_back(mesh_level(std::get<TriangleMesh>(scene.shapes[meshes[i]]), visits[meshes[i]]));
  for (Level& level : levels) level.alike = static_cast<double>(meshes.size()) / static_cast<double>(levels.size());
  return levels;
}

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
  const auto item = [&](std::size_t i) { return Sample::Item{boxes[i], half_area(boxes[i])}; };
  levels.objects = level_of(sample_of(boxes.size(), item), kObjectTest, 1);
  for (double& of_shape : visits) of_shape *= scale;
  levels.meshes = mesh_levels(scene, visits);
  constexpr std::size_t kFew = 65;  // as in `WideAccel`
  constexpr double kLarge = 1000;
  levels.objects.is_few_with_meshes = boxes.size() <= kFew && std::ranges::any_of(levels.meshes, [](const Level& mesh) {
                                        return mesh.items >= kLarge;
                                      });
  return levels;
}

AccelEstimate estimate(const AccelOptions& options, const Levels& levels, double rays) {
  const bool builds = options.kind != AccelKind::brute;
  const Cost objects = cost_of(options.kind, levels.objects, false);
  double build = objects.build, walk = kRay + objects.walk;
  for (const Level& mesh : levels.meshes) {
    const Cost cost = cost_of(options.kind, mesh, true);
    build += mesh.alike * cost.build;
    // Without bounds every ray comes to every mesh.
    walk += mesh.alike * cost.walk * (builds ? mesh.visits : std::max(mesh.visits, 1.0));
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

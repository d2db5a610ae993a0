#include "core/accel/scene_items.h"

#include <algorithm>
#include <span>

#include "core/accel/build_stop.h"
#include "core/bounds/box_bound.h"
#include "core/bounds/hull_bound.h"
#include "core/geometry/shape_outline.h"

namespace tessera {
namespace {

/// Points of all objects' outlines together, instances counted: 16 million take a second or two. Shapes that would
/// bring more are known by the corners of their boxes.
constexpr std::size_t kMostPoints = 1 << 24;

/// So few points, instances counted, are fitted sooner than thinned; and boxes to any number of points of so few
/// instances, since a hull takes many times as long as a box (tried with one instance of 500,000 points).
constexpr std::size_t kFewPoints = 1 << 16, kFewBoxed = 32;

std::vector<Aabb> triangle_boxes(const TriangleMesh& mesh) {
  std::vector<Aabb> boxes(mesh.triangles.size());
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (const std::uint32_t corner : mesh.triangles[i]) boxes[i].extend(mesh.positions[corner]);
  return boxes;
}

Outline corners(const Aabb& box) {
  Outline outline;
  if (box.empty()) return outline;
  for (int i = 0; i < 8; ++i)
    outline.points.push_back({i & 1 ? box.hi.x : box.lo.x, i & 2 ? box.hi.y : box.lo.y, i & 4 ? box.hi.z : box.lo.z});
  return outline;
}

/// Whether the box of the object's shape, carried to the world, is a box there too: then points fit hardly better.
bool is_known_by_box(const Object& object) {
  if (!object.placement) return true;
  const std::array<double, 12> rows = object.placement->rows();
  for (std::size_t row = 0; row < 12; row += 4)
    if (std::ranges::count(std::span(&rows[row], 3), 0.0) < 2) return false;
  return true;
}

/// The shape's outline, with the points of its convex hull alone where it has many; `points_left` of the scene's
/// allowance are reduced by what it brings.
Outline shape_outline(const Shape& shape, const Aabb& box, BoundKind bound, std::size_t objects,
                      std::size_t& points_left) {
  Outline seen = outline(shape);
  const bool are_few = seen.points.size() * objects <= kFewPoints || (bound == BoundKind::box && objects <= kFewBoxed);
  if (!are_few) HullBound().fit(seen);
  if (seen.points.size() > points_left / objects) seen = corners(box);
  points_left -= std::min(points_left, seen.points.size() * objects);
  return seen;
}

std::vector<Outline> shape_outlines(const Scene& scene, const AccelOptions& options) {
  std::vector<Outline> outlines(scene.shapes.size());
  if (options.kind == AccelKind::brute) return outlines;
  const std::span<const Aabb> boxes = local_bounds(scene);
  std::size_t points_left = kMostPoints;
  std::vector<std::size_t> uses(scene.shapes.size(), 0);
  for (const Object& object : scene.objects)
    if (options.bound != BoundKind::box || !is_known_by_box(object)) ++uses[object.shape];
  for (std::size_t i = 0; i < outlines.size(); ++i) {
    if (uses[i] == 0) continue;
    BuildStop::check();
    outlines[i] = options.space == BoundSpace::object
                      ? corners(boxes[i])
                      : shape_outline(scene.shapes[i], boxes[i], options.bound, uses[i], points_left);
  }
  return outlines;
}

std::vector<Aabb> object_boxes(const Scene& scene, const std::vector<Outline>& outlines) {
  const std::span<const Aabb> local = local_bounds(scene);
  std::vector<Aabb> boxes;
  boxes.reserve(scene.objects.size());
  for (const Object& object : scene.objects) {
    if (!object.placement) {
      boxes.push_back(local[object.shape]);
      continue;
    }
    BuildStop::check();
    const bool by_box = is_known_by_box(object);
    Outline seen = world_outline(object, by_box ? corners(local[object.shape]) : outlines[object.shape]);
    boxes.push_back(BoxBound().fit(seen));
  }
  return boxes;
}

}  // namespace

TriangleItems::TriangleItems(const TriangleMesh& mesh) : Items(triangle_boxes(mesh)), mesh_(mesh) {}

void TriangleItems::outline(std::uint32_t item, Outline& out) const {
  for (const std::uint32_t corner : mesh_.triangles[item]) out.points.push_back(mesh_.positions[corner]);
}

std::optional<std::array<Vec3, 3>> TriangleItems::triangle(std::uint32_t item) const {
  const TriangleIndices& t = mesh_.triangles[item];
  return {{mesh_.positions[t[0]], mesh_.positions[t[1]], mesh_.positions[t[2]]}};
}

ObjectItems::ObjectItems(const Scene& scene, const AccelOptions& options)
    : ObjectItems(scene, shape_outlines(scene, options)) {}

ObjectItems::ObjectItems(const Scene& scene, std::vector<Outline> outlines)
    : Items(object_boxes(scene, outlines)), scene_(scene), outlines_(std::move(outlines)) {}

void ObjectItems::outline(std::uint32_t item, Outline& out) const {
  const Object& object = scene_.objects[item];
  out.append(object.placement ? world_outline(object, outlines_[object.shape]) : outlines_[object.shape]);
}

}  // namespace tessera

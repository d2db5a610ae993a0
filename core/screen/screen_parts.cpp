#include "core/screen/screen_parts.h"

#include <algorithm>
#include <cmath>

#include "core/screen/screen_rect.h"

namespace tessera {
namespace {

/// Cubes along the longest side of a mesh's box. A closed surface passes through some 3n² of n³ of them.
std::uint32_t resolution(std::size_t triangles, std::uint32_t most_parts) {
  const double by_triangles = std::sqrt(static_cast<double>(triangles) / (3 * 4));
  return static_cast<std::uint32_t>(std::max(std::min(by_triangles, std::cbrt(most_parts)), 1.0));
}

/// The boxes of a mesh's parts, in its own space.
std::vector<Aabb> divide(const TriangleMesh& mesh, const Aabb& whole, std::uint32_t most_parts) {
  const std::uint32_t n = resolution(mesh.triangles.size(), most_parts);
  const Vec3d lo = to_double(whole.lo);
  const double longest = max_component(to_double(whole.hi) - lo);
  if (n == 1 || !(longest > 0)) return {whole};
  const double scale = n / longest;
  std::vector<Aabb> cubes(std::size_t{n} * n * n);
  for (const TriangleIndices& triangle : mesh.triangles) {
    Aabb box;
    for (const std::uint32_t vertex : triangle) box.extend(mesh.positions[vertex]);
    const Vec3d at = (to_double(box.center()) - lo) * scale;
    const auto cube = [n](double v) { return std::min(static_cast<std::uint32_t>(std::max(v, 0.0)), n - 1); };
    cubes[(std::size_t{cube(at.x)} * n + cube(at.y)) * n + cube(at.z)].extend(box);
  }
  std::erase_if(cubes, [](const Aabb& box) { return box.empty(); });
  return cubes;
}

bool is_divided(const Scene& scene, std::size_t object, PixelRect area, std::int32_t smallest) {
  return std::max(area.width(), area.height()) > smallest &&
         std::holds_alternative<TriangleMesh>(scene.shapes[scene.objects[object].shape]);
}

}  // namespace

std::vector<ScreenPart> screen_parts(const Scene& scene, const CameraRays& camera, std::span<const PixelRect> areas,
                                     std::int32_t smallest) {
  std::uint32_t divided = 0;
  for (std::size_t i = 0; i < areas.size(); ++i) divided += is_divided(scene, i, areas[i], smallest) ? 1 : 0;

  std::vector<ScreenPart> parts;
  std::vector<std::vector<Aabb>> of_shape(scene.shapes.size());  // instances share them
  for (std::uint32_t i = 0; i < areas.size(); ++i) {
    if (!is_divided(scene, i, areas[i], smallest)) {
      if (!areas[i].empty()) parts.push_back({areas[i], i});
      continue;
    }
    const Object& object = scene.objects[i];
    std::vector<Aabb>& boxes = of_shape[object.shape];
    if (boxes.empty()) {
      const Shape& shape = scene.shapes[object.shape];
      boxes = divide(std::get<TriangleMesh>(shape), local_bounds(scene)[object.shape], kMostParts / divided);
    }
    const Transform::Error error = object.placement ? object.placement->error() : Transform::Error{};
    for (const Aabb& box : boxes) {
      const PixelRect area = intersect(areas[i], screen_rect(world_bounds(object, box), camera, error));
      if (!area.empty()) parts.push_back({area, i});
    }
  }
  return parts;
}

}  // namespace tessera

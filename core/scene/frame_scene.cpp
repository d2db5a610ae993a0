#include "core/scene/frame_scene.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/geometry/shape_outline.h"
#include "core/math/float_environment.h"
#include "core/scene/film_plane.h"

namespace tessera {
namespace {

/// Of the image's smaller side.
constexpr double kMargin = 0.04;

/// How many vertices are looked at one by one, in some 10 ms; of further meshes the box is framed.
constexpr std::size_t kMostVertices = 1'000'000;

/// How far from all there is to see a camera keeps, in sizes of the scene.
constexpr double kLeastDistance = 0x1p-10;

/// How far ahead `at` lies, in distances of the camera from the origin, so that floats tell it from `from`.
constexpr double kLeastDepth = 0x1p-22;

/// Beyond this the image is a point of light, whatever the field of view; and floats end soon.
constexpr double kFarthest = 1e30;

/// Sideways, and forward: a camera's axes. Orthonormal.
struct Axes {
  explicit Axes(const View& view)
      : forward(unit(to_double(view.at) - to_double(view.from))),
        right(unit(cross(forward, to_double(view.up)))),
        up(cross(right, forward)) {}

  static Vec3d unit(Vec3d v) {
    v = v / max_component(abs(v));
    return v / length(v);
  }

  Vec3d forward, right, up;
};

/// A few directions, and how far the scene reaches along each.
struct Reach {
  std::array<Vec3d, 6> ways;
  std::array<double, 6> farthest;
};

void extend(Reach& reach, const Outline& outline) {
  for (std::size_t i = 0; i < 6; ++i)
    reach.farthest[i] = std::max(reach.farthest[i], extent_along(reach.ways[i], outline).hi);
}

Outline corners(const Aabb& box) {
  Outline out;
  for (int corner = 0; corner < 8; ++corner)
    out.points.push_back(
        {corner & 1 ? box.hi.x : box.lo.x, corner & 2 ? box.hi.y : box.lo.y, corner & 4 ? box.hi.z : box.lo.z});
  return out;
}

/// A mesh, vertex by vertex: copying an outline of it to the world would take its memory again. Vertices that no
/// triangle uses aren't told from others, but count for nothing outside `box`, that of the triangles.
void extend(Reach& reach, const TriangleMesh& mesh, const Aabb& box, const Object& object) {
  std::array<Vec3d, 6> ways = reach.ways;
  std::array<double, 6> starts{};
  if (object.placement) {
    const auto& m = object.placement->rows();
    for (std::size_t i = 0; i < 6; ++i) {
      starts[i] = dot(ways[i], {m[3], m[7], m[11]});
      ways[i] = {dot(ways[i], {m[0], m[4], m[8]}), dot(ways[i], {m[1], m[5], m[9]}), dot(ways[i], {m[2], m[6], m[10]})};
    }
  }
  for (const Vec3 p : mesh.positions) {
    if (!box.contains(p)) continue;
    for (std::size_t i = 0; i < 6; ++i)
      reach.farthest[i] = std::max(reach.farthest[i], starts[i] + dot(ways[i], to_double(p)));
  }
}

/// How far the scene's surface, of which `box` is the box and `size` the box's diagonal, reaches; a little more for the
/// rounding of the camera that follows from it.
Reach reach_of(const Scene& scene, const Aabb& box, double size, const std::array<Vec3d, 6>& ways) {
  Reach reach{ways, {}};
  reach.farthest.fill(-kInfinity);
  std::size_t vertices_left = kMostVertices;
  for (const Object& object : scene.objects) {
    const Aabb around = world_bounds(scene, object);
    if (around.empty()) continue;
    Reach most = reach;
    extend(most, corners(around));
    if (most.farthest == reach.farthest) continue;
    const Shape& shape = scene.shapes[object.shape];
    const auto* mesh = std::get_if<TriangleMesh>(&shape);
    if (!mesh) {
      extend(reach, world_outline(object, outline(shape)));
    } else if (mesh->positions.size() <= vertices_left) {
      vertices_left -= mesh->positions.size();
      extend(reach, *mesh, local_bounds(scene)[object.shape], object);
    } else {
      reach = most;
    }
  }
  if (reach.farthest.front() == -kInfinity) extend(reach, corners(box));
  const double largest = std::max<double>(max_component(abs(box.lo)), max_component(abs(box.hi)));
  const double more = (size > 0 ? 0 : 1) + 8 * (kUnitRoundoff * largest + kDenormalStep);
  for (std::size_t i = 0; i < 6; ++i) reach.farthest[i] += more * length(reach.ways[i]);
  return reach;
}

}  // namespace

Camera frame_scene(const Scene& scene, std::uint32_t width, std::uint32_t height, Camera camera) {
  View& view = std::visit([](auto& c) -> View& { return c.view; }, camera);
  if (view.is_placed) return camera;
  const StrictFloats strict;
  Aabb box;
  for (const Aabb& object : world_bounds(scene)) box.extend(object);
  if (box.empty()) box = {{-0.5F, -0.5F, -0.5F}, {0.5F, 0.5F, 0.5F}};
  const double extent = length(to_double(box.hi) - to_double(box.lo)), size = extent > 0 ? extent : 1;

  const double smaller = std::min(width, height);
  const double margin = std::min(std::max(kMargin * smaller, 1.0), smaller / 4);
  const double free_width = width - 2 * margin, free_height = height - 2 * margin;  // in pixels
  const Axes axes(view);
  const auto* perspective = std::get_if<PerspectiveCamera>(&camera);

  // Along the normals of the four planes through the camera that bound what is free, at slopes that are 0 when rays are
  // parallel; nearest; and farthest.
  const FilmPlane film = perspective ? film_plane(*perspective, width, height) : FilmPlane{};
  const double to_right = film.pixel_x * (width - film.axis_x - margin),
               to_left = film.pixel_x * (film.axis_x - margin);
  const double to_top = film.pixel_y * (film.axis_y - margin),
               to_bottom = film.pixel_y * (height - film.axis_y - margin);
  const auto [right, left, up, down, nearest, farthest] =
      reach_of(scene, box, extent,
               {axes.right - to_right * axes.forward, -axes.right - to_left * axes.forward,
                axes.up - to_top * axes.forward, -axes.up - to_bottom * axes.forward, -axes.forward, axes.forward})
          .farthest;

  // The camera stands at x, y, z along its axes. It is inside all planes when x − to_right·z, −x − to_left·z and so on
  // reach at least as far: x and y are in the middle of what that leaves them, z is the largest that leaves them
  // anything.
  double z = -nearest - (perspective ? kLeastDistance : 1) * size;
  if (perspective) {
    z = std::min({z, -(right + left) / (film.pixel_x * free_width), -(up + down) / (film.pixel_y * free_height)});
    z = std::max(z, -kFarthest);
  }
  const auto middle = [](double v) { return std::clamp(0.5 * v, -kFarthest, kFarthest); };
  const double x = middle(right - left + (to_right - to_left) * z), y = middle(up - down + (to_top - to_bottom) * z);
  if (!perspective) {
    const double needed = std::max((right + left) / free_width, (up + down) / free_height) * height;
    std::get<OrthographicCamera>(camera).height = static_cast<float>(needed);
  }
  const Vec3d from = x * axes.right + y * axes.up + z * axes.forward;
  const double depth = std::max(0.5 * (farthest - nearest) - z, kLeastDepth * max_component(abs(from)));
  view = {to_float(from), to_float(from + depth * axes.forward), view.up};
  return camera;
}

}  // namespace tessera

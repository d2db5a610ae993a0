#include "core/bounds/hull_bound.h"

#include <algorithm>
#include <utility>

#include "core/bounds/box_bound.h"
#include "core/bounds/facets.h"

namespace tessera {
namespace {

/// Points on the ellipsoid, evenly in the space of its axes: 16 around an ellipse, otherwise 26 as on a cube.
void add_samples(const Ellipsoid& e, std::vector<Vec3>& points) {
  const bool flat = e.axes[2] == Vec3d{};
  const int reach = flat ? 2 : 1;
  for (int x = -reach; x <= reach; ++x)
    for (int y = -reach; y <= reach; ++y)
      for (int z = flat ? 0 : -1; z <= (flat ? 0 : 1); ++z) {
        if (flat ? x % 2 == 0 && y % 2 == 0 : x == 0 && y == 0 && z == 0) continue;
        const Vec3d a{double(x), double(y), double(z)};
        points.push_back(to_float(e.center + (a.x * e.axes[0] + a.y * e.axes[1] + a.z * e.axes[2]) / length(a)));
      }
}

bool are_finite(const std::vector<Vec3>& points) {
  return std::ranges::all_of(points, [](Vec3 p) { return is_finite(p); });
}

/// The greatest n·p in a box, rounded outward.
float farthest_along(Vec3 n, const Aabb& box) {
  double sum = 0, size = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (n[axis] == 0) continue;
    const double term = double{n[axis]} * (n[axis] > 0 ? box.hi : box.lo)[axis];
    sum += term;
    size += std::abs(term);
  }
  return above(sum + size * 0x1p-50);
}

/// How far inside the hull of samples an ellipsoid has to be to decide nothing, as a share of the coordinates: far more
/// than samples and planes round.
constexpr double kInside = 0x1p-18;

/// Marks the points at corners of their own hull and the ellipsoids not surely inside that of the samples, counted as
/// in `Extent`. Samples are rounded, so they may lie outside of what they are of: no point is left out on their word.
std::vector<bool> decisive(const Outline& outline, const ConvexHull& hull, const std::vector<Vec3>& points) {
  const std::size_t n = outline.points.size();
  std::vector<bool> marked(n + outline.ellipsoids.size());
  const bool only_points = outline.ellipsoids.empty();
  for (const std::uint32_t vertex : only_points ? hull.vertices : convex_hull(outline.points).vertices)
    marked[vertex] = true;
  if (only_points) return marked;

  double size = 0;
  for (const std::uint32_t vertex : hull.vertices) size = std::max<double>(size, max_component(abs(points[vertex])));
  std::vector<std::pair<Vec3d, double>> inner;  // normals of length 1, and offsets
  for (const auto& [a, b, c] : hull.faces) {
    const Vec3d pa = to_double(points[a]);
    const Vec3d normal = cross(to_double(points[b]) - pa, to_double(points[c]) - pa);
    inner.emplace_back(normal / length(normal), dot(normal / length(normal), pa) - kInside * size);
  }
  const auto is_inside = [&](const Ellipsoid& e) {
    return hull.dimension == 3 && std::ranges::all_of(inner, [&](const auto& plane) {
             const Vec3d p = plane.first;
             return dot(p, e.center) + length(Vec3d{dot(p, e.axes[0]), dot(p, e.axes[1]), dot(p, e.axes[2])}) <=
                    plane.second;
           });
  };
  for (std::size_t i = 0; i < outline.ellipsoids.size(); ++i) marked[n + i] = !is_inside(outline.ellipsoids[i]);
  return marked;
}

}  // namespace

/// What is rounded beside what `cull_pad` has: n·o, three times, at most 2^-53 · √3 · |o|∞ each.
HullClipper::HullClipper(const Ray& ray, const Aabb& reach, Transform::Error placed)
    : box_(ray, reach, placed), origin_(to_double(ray.origin)), direction_(to_double(ray.direction)) {
  const double length1 = std::numbers::sqrt3 * (1 + 0x1p-20);
  pad_ = length1 * (cull_pad(ray, reach, placed) + 0x1p-50 * max_component(abs(origin_)));
  least_slope_ = length1 * kLeastSlope * max_component(abs(direction_));
}

Polytope HullBound::fit(Outline& outline) const {
  Outline for_box = outline;
  Polytope polytope{BoxBound().fit(for_box), {}, 0};
  std::vector<Vec3> points = outline.points;
  for (const Ellipsoid& e : outline.ellipsoids) add_samples(e, points);
  if (!are_finite(points)) {  // samples beyond a float's range; the box still holds what they are of
    polytope.half_area = half_area(polytope.box);
    return polytope;
  }

  const ConvexHull hull = convex_hull(points);
  keep(outline, decisive(outline, hull, points));
  polytope.half_area = half_area(hull, points);
  const std::vector<Facet> chosen = spread(facets_of(hull, points), max_faces);
  polytope.planes.reserve(chosen.size());
  for (const Facet& facet : chosen) {
    const Vec3 normal = to_float(facet.normal);
    polytope.planes.push_back({normal, above(extent_along(to_double(normal), outline).hi)});
  }
  return polytope;
}

Polytope HullBound::join(const Polytope& a, const Polytope& b) const {
  if (a.box.empty()) return b;
  if (b.box.empty()) return a;
  Polytope both{BoxBound().join(a.box, b.box), {}, 0};
  both.half_area = half_area(both.box);
  const auto add_planes = [&](const Polytope& from, const Aabb& other, std::size_t count) {
    for (std::size_t i = 0; i < std::min(count, from.planes.size()); ++i) {
      const auto& [normal, offset] = from.planes[i];
      both.planes.push_back({normal, std::max(offset, farthest_along(normal, other))});
    }
  };
  add_planes(a, b.box, max_faces / 2);
  add_planes(b, a.box, max_faces - both.planes.size());
  return both;
}

bool HullBound::contains(const Polytope& polytope, Vec3 p) const {
  return polytope.box.contains(p) && std::ranges::all_of(polytope.planes, [&](const HalfSpace& plane) {
           return dot(to_double(plane.normal), to_double(p)) <= plane.offset;
         });
}

}  // namespace tessera

#include "core/geometry/shape_outline.h"

#include <cmath>

namespace tessera {
namespace {

/// The circle across `axis` (not zero, any length). Its axes are at right angles to that and to each other, and of the
/// right length, but for some ten roundings of 2^-53, which `slack` takes.
void add_circle(Vec3d center, Vec3d axis, double radius, Outline& out) {
  const Vec3d n = axis / length(axis);
  const Vec3d a = abs(n);
  const Vec3d least = a.x <= a.y && a.x <= a.z ? Vec3d{1, 0, 0} : a.y <= a.z ? Vec3d{0, 1, 0} : Vec3d{0, 0, 1};
  const Vec3d across = cross(n, least);
  const Vec3d u = across / length(across);
  out.ellipsoids.push_back({center, {radius * u, radius * cross(n, u), {}}});
  out.slack = std::max(out.slack, radius * 0x1p-49);
}

Outline outline_of(const TriangleMesh& mesh) {
  Outline out;
  std::vector<bool> seen(mesh.positions.size());
  for (const TriangleIndices& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle) {
      if (!seen[vertex]) out.points.push_back(mesh.positions[vertex]);
      seen[vertex] = true;
    }
  return out;
}

Outline outline_of(const Sphere& sphere) {
  const double r = sphere.radius;
  return {{}, {{to_double(sphere.center), {{r, 0, 0}, {0, r, 0}, {0, 0, r}}}}, 0};
}

Outline outline_of(const Cone& cone) {
  Outline out;
  const Vec3d base = to_double(cone.base), apex = to_double(cone.apex);
  add_circle(base, apex - base, hit_radius(cone, cone.base_radius), out);
  add_circle(apex, apex - base, hit_radius(cone, cone.apex_radius), out);
  return out;
}

Outline outline_of(const Cylinder& c) { return outline_of(Cone{c.base, c.radius, c.apex, c.radius}); }

Outline outline_of(const Disk& disk) {
  Outline out;
  add_circle(to_double(disk.center), to_double(disk.normal), disk.radius, out);
  return out;
}

Outline outline_of(const Quad& quad) { return {{quad.corners.begin(), quad.corners.end()}, {}, 0}; }

}  // namespace

Outline outline(const Shape& shape) {
  return std::visit([](const auto& s) { return outline_of(s); }, shape);
}

}  // namespace tessera

#include "core/geometry/triangle.h"

namespace tessera {
namespace {

Vec3d unit_or(Vec3d v, Vec3d otherwise) {
  const double scale = max_component(abs(v));
  if (!(scale > 0)) return otherwise;
  v = v / scale;
  return v / length(v);
}

}  // namespace

SurfacePoint triangle_surface(const TriangleRay& ray, const Vec3 (&corners)[3], const Vec3* normals) {
  const TriangleWeights w = weights(ray.see(corners[0]), ray.see(corners[1]), ray.see(corners[2]));
  const double sum = w.sum();
  const double share[3] = {w.a / sum, w.b / sum, w.c / sum};
  const Vec3d a = to_double(corners[0]), b = to_double(corners[1]), c = to_double(corners[2]);

  SurfacePoint out;
  out.position = a * share[0] + b * share[1] + c * share[2];
  // Whatever its weights, a mix of corners lies in the triangle's plane, but for roundings: less than 2^-48 of the
  // largest coordinate, along every axis, since the next ray's test mixes them all into its t.
  const double stray = max_component(max(abs(a), max(abs(b), abs(c)))) * 0x1p-48;
  out.error = {stray, stray, stray};
  const Vec3d flat = unit_or(cross(b - a, c - a), {0, 0, 1});
  out.geometric_normal = out.shading_normal = flat;
  if (normals) {
    const Vec3d smooth =
        to_double(normals[0]) * share[0] + to_double(normals[1]) * share[1] + to_double(normals[2]) * share[2];
    // Files exist whose normals point against their winding: the winding says which side is out.
    out.shading_normal = unit_or(dot(smooth, flat) < 0 ? -smooth : smooth, flat);
  }
  return out;
}

}  // namespace tessera

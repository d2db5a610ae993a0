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
  const Vec3d p = a * share[0] + b * share[1] + c * share[2];
  out.position = to_float(p);
  // A convex mix of corners, in double, is on the triangle but for the last rounding to float; the double part
  // (2^-50 of the corners) counts only where it mixes far corners into a point near zero.
  const Vec3d reach = max(abs(a), max(abs(b), abs(c)));
  out.error =
      to_float(abs(p) * kUnitRoundoff * 2 + reach * 0x1p-48 + Vec3d{kDenormalStep, kDenormalStep, kDenormalStep});
  const Vec3d flat = unit_or(cross(b - a, c - a), {0, 0, 1});
  out.geometric_normal = out.shading_normal = to_float(flat);
  if (normals) {
    const Vec3d smooth =
        to_double(normals[0]) * share[0] + to_double(normals[1]) * share[1] + to_double(normals[2]) * share[2];
    out.shading_normal = to_float(unit_or(smooth, flat));
  }
  return out;
}

}  // namespace tessera

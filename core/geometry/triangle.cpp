#include "core/geometry/triangle.h"

#include "core/math/orientation.h"

namespace tessera {
namespace {

Vec3d unit_or(Vec3d v, Vec3d otherwise) {
  const double scale = max_component(abs(v));
  if (!(scale > 0)) return otherwise;
  v = v / scale;
  return v / length(v);
}

/// Whether all the normals of the corners are the face's own, on either side, but for what floats lose: a mesh with
/// such normals is as flat as one without.
bool all_along(Vec3d flat, const Vec3* normals) {
  constexpr double kLittle = 0x1p-20;  // radians
  const double side = dot(to_double(normals[0]), flat) < 0 ? -1 : 1;
  for (int i = 0; i < 3; ++i) {
    const Vec3d n = to_double(normals[i]);
    const double along = side * dot(n, flat);
    const Vec3d across = n - (side * along) * flat;
    if (!(along > 0 && dot(across, across) <= kLittle * kLittle * (along * along))) return false;
  }
  return true;
}

/// The mix of the point's projections onto the corners' tangent planes, those that lie farther out, `out` being the
/// normal of the side in question (Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II, 2021; without its
/// bound the same as Boubekeur & Alexa, "Phong Tessellation", 2008). It lies about twice as far out as a sphere through
/// the corners, so never beneath it. The normals times `turned` are on that side; one that isn't counts for nothing.
Vec3d to_smooth(Vec3d point, Vec3d out, const Vec3 (&corners)[3], const Vec3* normals, const double (&share)[3],
                double turned) {
  Vec3d sum;
  for (int i = 0; i < 3; ++i) {
    const Vec3d n = turned * to_double(normals[i]);
    const double below = dot(to_double(corners[i]) - point, n);
    if (below > 0 && dot(n, out) > 0) sum = sum + n * (share[i] * below / dot(n, n));
  }
  return sum;
}

}  // namespace

std::optional<TriangleWeights> exact_weights(const TriangleRay& ray, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 o = ray.ray().origin, d = ray.ray().direction;
  const TriangleWeights w{turning(o, d, c, b) / ray.scale_z(), turning(o, d, a, c) / ray.scale_z(),
                          turning(o, d, b, a) / ray.scale_z()};
  if (!w.inside() || w.sum() == 0) return std::nullopt;
  return w;
}

/// By Cramer's rule: with all points seen from the origin, the weights mix the corners to −det(a, b, c) · direction.
double exact_t(const TriangleRay& ray, double sum, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 o = ray.ray().origin, d = ray.ray().direction;
  // Most such rays have just left the triangle, which takes no whole numbers to see.
  if (ray.ray().t_min >= 0 && orientation(a, b, c, o) * (sum * ray.scale_z()) <= 0) return 0;
  return -volume(o, a, b, c) / (turning(o, d, c, b) + turning(o, d, a, c) + turning(o, d, b, a));
}

SurfacePoint triangle_surface(const TriangleRay& ray, const Vec3 (&corners)[3], const Vec3* normals) {
  const TriangleWeights w =
      crossing(ray, ray.see(corners[0]), ray.see(corners[1]), ray.see(corners[2]), corners[0], corners[1], corners[2])
          .value_or(TriangleWeights{1, 1, 1});
  const double sum = w.sum();
  const double share[3] = {w.a / sum, w.b / sum, w.c / sum};
  const Vec3d a = to_double(corners[0]), b = to_double(corners[1]), c = to_double(corners[2]);

  SurfacePoint out;
  out.second_share = share[1];
  out.third_share = share[2];
  out.position = a * share[0] + b * share[1] + c * share[2];
  // Whatever its weights, a mix of corners lies in the triangle's plane, but for roundings. With ε = 2^-53 and m the
  // largest coordinate of the corners along an axis: the shares add up to 1 but for 3·ε, which moves the point by 3·ε·m
  // along that axis, and the mix rounds by 3·ε·m. 32·ε·m is said: the rest is for the normal, which is off by a few ε
  // of what it is made of, and for the origin of the next ray, which rounds by ε·m before it becomes a float.
  out.error = max(abs(a), max(abs(b), abs(c))) * 0x1p-48;
  const Vec3d flat = unit_or(cross(b - a, c - a), {0, 0, 1});
  out.geometric_normal = out.shading_normal = flat;
  if (normals && !all_along(flat, normals)) {
    const Vec3d smooth =
        to_double(normals[0]) * share[0] + to_double(normals[1]) * share[1] + to_double(normals[2]) * share[2];
    // Files exist whose normals point against their winding: the winding says which side is out.
    const double turned = dot(smooth, flat) < 0 ? -1 : 1;
    out.shading_normal = unit_or(turned * smooth, flat);
    const bool from_front = dot(to_double(ray.ray().direction), flat) < 0;
    out.to_smooth =
        to_smooth(out.position, from_front ? flat : -flat, corners, normals, share, from_front ? turned : -turned);
  }
  return out;
}

}  // namespace tessera

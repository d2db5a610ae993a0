#pragma once

#include <optional>

#include "core/geometry/surface_point.h"
#include "core/math/ray.h"

namespace tessera {

/// A ray set up for triangles: its space is sheared so that the ray becomes the z axis (Woop, Benthin & Wald,
/// "Watertight Ray/Triangle Intersection", JCGT 2013). One shear serves every triangle, so a vertex lands on one
/// point whichever triangle asks.
class TriangleRay {
 public:
  explicit TriangleRay(const Ray& ray) : ray_(ray), origin_(to_double(ray.origin)) {
    const Vec3 size = abs(ray.direction);
    z_ = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    x_ = (z_ + 1) % 3;
    y_ = (z_ + 2) % 3;
    const double dz = ray.direction[z_];
    shear_x_ = ray.direction[x_] / dz;
    shear_y_ = ray.direction[y_] / dz;
    scale_z_ = dz;
  }

  const Ray& ray() const { return ray_; }

  /// A vertex as the ray sees it: x and y across the ray, z along its largest axis. All in double: the difference
  /// of two floats is then exact or nearly so, and t is right to the last float bit however long the triangle.
  Vec3d see(Vec3 vertex) const {
    const Vec3d v = to_double(vertex) - origin_;
    const double z = v[z_];
    return {v[x_] - shear_x_ * z, v[y_] - shear_y_ * z, z};
  }
  double scale_z() const { return scale_z_; }

 private:
  const Ray& ray_;
  Vec3d origin_;
  double shear_x_, shear_y_, scale_z_;
  int x_, y_, z_;
};

/// Signed weights of a triangle's corners where a ray crosses it, not normalised.
struct TriangleWeights {
  double a, b, c;
  double sum() const { return a + b + c; }

  /// All of one sign. False with a NaN among them.
  bool inside() const { return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0); }
};

/// Edge functions of the sheared corners: det(ray direction, q − origin, p − origin) / direction.z for each edge.
inline TriangleWeights weights(Vec3d a, Vec3d b, Vec3d c) {
  return {c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x};
}

/// The weights, exact but for a last rounding each; nothing when they aren't inside, or have no sum.
std::optional<TriangleWeights> exact_weights(const TriangleRay& ray, Vec3 a, Vec3 b, Vec3 c);

/// The weights of a hit; nothing for a miss. Decided exactly, for the float ray and the float corners: so no ray passes
/// between triangles that share an edge or a vertex, edges being counted as inside, and a triangle without area is
/// never hit, whatever lies beside it.
///
/// Let l be the largest coordinate of a sheared corner across the ray, z the largest along it, r the range of the
/// latter, and ε = 2^-53. A sheared coordinate is off by 4·ε·(l + 2z) at most, an edge function by 40·ε·l·(l + z), less
/// than 2^-47·l·(l + z): beyond that its sign is certain. A mix of the corners' depths is then off by less than
/// 3·2^-47·l·(l + z)·r over the sum of the weights; that is below what culling allows for, 2^-30 of the ray's reach,
/// which is (l + z)/3 or more, where the sum is above 9·2^-17·l·r.
inline std::optional<TriangleWeights> crossing(const TriangleRay& ray, Vec3d pa, Vec3d pb, Vec3d pc, Vec3 a, Vec3 b,
                                               Vec3 c) {
  const TriangleWeights w = weights(pa, pb, pc);
  const Vec3d size = max(abs(pa), max(abs(pb), abs(pc)));
  const double across = std::max(size.x, size.y);
  const double least = std::min(std::abs(w.a), std::min(std::abs(w.b), std::abs(w.c)));
  if (least <= 0x1p-47 * across * (across + size.z)) [[unlikely]]
    return exact_weights(ray, a, b, c);
  if (!w.inside()) return std::nullopt;
  const double range = std::max(pa.z, std::max(pb.z, pc.z)) - std::min(pa.z, std::min(pb.z, pc.z));
  if (std::abs(w.sum()) <= 0x1p-13 * across * range) [[unlikely]]
    return exact_weights(ray, a, b, c);
  return w;
}

/// Below this a hit's depth, times the sum of the weights, may have the wrong sign. With l, z and ε as for `crossing`,
/// three weights that are off by 40·ε·l·(l + z) each make it wrong by 120·ε·l·(l + z)·z, its own roundings by
/// 32·ε·l²·z.
inline double depth_limit(Vec3d pa, Vec3d pb, Vec3d pc) {
  const Vec3d size = max(abs(pa), max(abs(pb), abs(pc)));
  const double across = std::max(size.x, size.y);
  return 0x1p-45 * across * (across + size.z) * size.z;
}

/// The t of a hit, exact but for some roundings, however near the triangle's plane the origin lies. One below 0 may be
/// told as 0, which is as good for rays that begin there or later. `sum` is that of the weights.
double exact_t(const TriangleRay& ray, double sum, Vec3 a, Vec3 b, Vec3 c);

/// t where the ray meets the triangle, edges and corners included, either side, within the ray's open interval.
/// Triangles of no area, or seen exactly edge-on, are missed; so is everything by a ray with a NaN.
inline std::optional<float> intersect_triangle(const TriangleRay& ray, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3d pa = ray.see(a), pb = ray.see(b), pc = ray.see(c);
  const auto w = crossing(ray, pa, pb, pc, a, b, c);
  if (!w) return std::nullopt;
  const double depth = w->a * pa.z + w->b * pb.z + w->c * pc.z;
  auto t = static_cast<float>(depth / (w->sum() * ray.scale_z()));
  if (std::abs(depth) <= depth_limit(pa, pb, pc)) [[unlikely]]
    t = static_cast<float>(exact_t(ray, w->sum(), a, b, c));
  if (!(t > ray.ray().t_min && t < ray.ray().t_max)) return std::nullopt;
  return t;
}

/// Where a ray that hit the triangle did so. `normals`, one a corner and not all of length 1, may be null.
SurfacePoint triangle_surface(const TriangleRay& ray, const Vec3 (&corners)[3], const Vec3* normals);

}  // namespace tessera

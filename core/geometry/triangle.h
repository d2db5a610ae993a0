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

/// Edge functions of the sheared corners. Rounding is monotone, so fl(pq) − fl(rs) is either zero or has the exact
/// sign of pq − rs; and two triangles see their common edge with exactly opposite values. Hence, with edges
/// counted as inside, no ray passes between triangles that share an edge or a vertex.
inline TriangleWeights weights(Vec3d a, Vec3d b, Vec3d c) {
  return {c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x};
}

/// t where the ray meets the triangle, edges and corners included, either side, within the ray's open interval.
/// Triangles of no area, or seen edge-on, are missed; so is everything by a ray with a NaN.
inline std::optional<float> intersect_triangle(const TriangleRay& ray, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3d pa = ray.see(a), pb = ray.see(b), pc = ray.see(c);
  const TriangleWeights w = weights(pa, pb, pc);
  if (!w.inside()) return std::nullopt;
  const double sum = w.sum();
  if (sum == 0) return std::nullopt;
  const auto t = static_cast<float>((w.a * pa.z + w.b * pb.z + w.c * pc.z) / (sum * ray.scale_z()));
  if (!(t > ray.ray().t_min && t < ray.ray().t_max)) return std::nullopt;
  return t;
}

/// Where a ray that hit the triangle did so. `normals`, one a corner and not all of length 1, may be null.
SurfacePoint triangle_surface(const TriangleRay& ray, const Vec3 (&corners)[3], const Vec3* normals);

}  // namespace tessera

#include "core/geometry/disk.h"

#include <cmath>

#include "core/geometry/circle_extent.h"
#include "core/geometry/double_root.h"

namespace tessera {
namespace {

struct Root {
  double t;
  Vec3d from_center;
};

/// However flat the ray lies, the point found is off the plane by no more than 6·ε·M (ε = 2^-53): the error of
/// n·d moves it along the ray by a distance that n·d itself scales down again. The edge is as sharp.
std::optional<Root> plane_root(const Disk& disk, const Ray& ray) {
  const Vec3d n = to_double(disk.normal), d = to_double(ray.direction);
  const Vec3d to_center = to_double(disk.center) - to_double(ray.origin);
  const double t = dot(n, to_center) / dot(n, d);
  const Vec3d from_center = t * d - to_center;
  const double radius = disk.radius;
  // False for a ray in the plane (0/0) or parallel to it (infinite t).
  if (dot(from_center, from_center) <= radius * radius && accepts(ray, t)) return Root{t, from_center};
  return std::nullopt;
}

}  // namespace

std::optional<float> intersect(const Disk& disk, const Ray& ray) {
  const auto root = plane_root(disk, ray);
  if (!root) return std::nullopt;
  return static_cast<float>(root->t);
}

SurfacePoint surface(const Disk& disk, const Ray& ray, float t) {
  const Vec3d n = to_double(disk.normal), center = to_double(disk.center);
  const auto root = plane_root(disk, narrowed_to(ray, t));
  const Vec3d found =
      root ? root->from_center : to_double(ray.origin) - center + static_cast<double>(t) * to_double(ray.direction);
  const Vec3d in_plane = found - (dot(n, found) / dot(n, n)) * n;
  const Vec3d normal = n / length(n);

  // What lies along the normal n̂ (unit) counts: n·found rounds by 4·ε·Σ|nᵢ·foundᵢ|, in_plane and its sum with the
  // centre by 2·ε of either. In all less than 6·ε·Σ|n̂ᵢ|·(|centerᵢ| + |in_planeᵢ|), which is a sum over axes. So is
  // what the next ray's n·to_center rounds by.
  const Vec3d error = (16 * kDoubleRoundoff) * (abs(center) + abs(in_plane));
  return {center + in_plane, error, normal, normal};
}

Aabb bounds(const Disk& disk) {
  const Vec3d center = to_double(disk.center);
  const Vec3d extent = static_cast<double>(disk.radius) * circle_extent(to_double(disk.normal));
  return outward(center - extent, center + extent);
}

}  // namespace tessera

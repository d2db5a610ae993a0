#include "core/geometry/sphere.h"

#include <cmath>

#include "core/geometry/double_root.h"

namespace tessera {
namespace {

struct Root {
  double t;
  Vec3d from_center;
};

/// |f|² − r² without the cancellation of two large squares when the centre is nearly straight along an axis: a
/// sphere as ground, seen from near its pole.
double power_of_origin(Vec3d f, double radius) {
  const Vec3d a = abs(f);
  const double largest = max_component(a);
  const double rest = a.x == largest   ? a.y * a.y + a.z * a.z
                      : a.y == largest ? a.z * a.z + a.x * a.x
                                       : a.x * a.x + a.y * a.y;
  return (largest - radius) * (largest + radius) + rest;
}

/// Solved about the foot of the perpendicular from the centre, so that |f|, not |f|², bounds what rounds (Haines
/// et al. 2019). With ε = 2^-53 the foot is known to 4·ε·|f|, so radius² of the point found is wrong by at most
/// 8·ε·r·|f| + 4·ε·r², and the point lies within 8·ε·M of the sphere before t is rounded: far inside 2^-30·M.
std::optional<Root> first_root(const Sphere& sphere, const Ray& ray) {
  const Vec3d d = to_double(ray.direction);
  const Vec3d f = to_double(sphere.center) - to_double(ray.origin);
  const double radius = sphere.radius;
  const double dd = dot(d, d);
  const double closest = dot(f, d) / dd;
  const Vec3d foot = f - closest * d;
  const double discriminant = radius * radius - dot(foot, foot);
  if (!(discriminant >= 0)) return std::nullopt;

  // The root of larger magnitude is a sum without cancellation; the other one follows from their product.
  const double half_chord = std::sqrt(discriminant / dd);
  const double larger = closest + std::copysign(half_chord, closest);
  const double smaller = larger == 0 ? 0 : power_of_origin(f, radius) / (dd * larger);
  const bool ahead = closest > 0;
  const double near = ahead ? smaller : larger;
  if (accepts(ray, near)) return Root{near, -foot - half_chord * d};
  const double far = ahead ? larger : smaller;
  if (accepts(ray, far)) return Root{far, half_chord * d - foot};
  return std::nullopt;
}

}  // namespace

std::optional<float> intersect(const Sphere& sphere, const Ray& ray) {
  const auto root = first_root(sphere, ray);
  if (!root) return std::nullopt;
  return static_cast<float>(root->t);
}

SurfacePoint surface(const Sphere& sphere, const Ray& ray, float t) {
  const Vec3d d = to_double(ray.direction);
  const Vec3d center = to_double(sphere.center);
  const auto root = first_root(sphere, narrowed_to(ray, t));
  Vec3d from_center = root ? root->from_center : to_double(ray.origin) - center + static_cast<double>(t) * d;
  if (from_center == Vec3d{}) from_center = -d;
  const Vec3d normal = from_center / length(from_center);

  // center + r·n rounds to 6·ε·(|center| + r). Doubled and more, so that a ray which starts this far off the exact
  // surface finds the sign of its power of the origin right (known to 5·ε·r²) and doesn't meet the surface again.
  const double r = sphere.radius;
  const Vec3d error = (16 * kDoubleRoundoff) * (abs(center) + Vec3d{r, r, r});
  return {center + r * normal, error, normal, normal};
}

Aabb bounds(const Sphere& sphere) {
  const Vec3d center = to_double(sphere.center);
  const double r = sphere.radius;
  return outward(center - Vec3d{r, r, r}, center + Vec3d{r, r, r});
}

}  // namespace tessera

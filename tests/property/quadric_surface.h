#pragma once

#include "core/geometry/cone.h"
#include "core/geometry/cylinder.h"
#include "core/geometry/disk.h"
#include "core/geometry/sphere.h"
#include "tests/support/random.h"
#include "tests/support/wide.h"

namespace tessera {

inline Vec3w normalized(Vec3w v) { return v / std::sqrt(dot(v, v)); }

/// A random point of the surface, in wider precision; extremes along the axes as often as not.
inline Vec3w extreme_or_random(Random& random) {
  if (random.bits() % 2) return normalized(widen(random.direction()));
  Vec3w v;
  v[static_cast<int>(random.bits() % 3)] = random.bits() % 2 ? 1 : -1;
  return v;
}

inline Vec3w point_on(const Sphere& sphere, Random& random) {
  return widen(sphere.center) + static_cast<Wide>(sphere.radius) * extreme_or_random(random);
}

/// The point of the circle across `axis` that reaches farthest along `toward`.
inline Vec3w on_circle(Vec3w axis, Vec3w toward) {
  const Vec3w n = normalized(axis);
  const Vec3w across = toward - dot(toward, n) * n;
  return dot(across, across) > 1e-24L ? normalized(across)
                                      : normalized(cross(n, std::abs(n.x) < 0.7L ? Vec3w{1} : Vec3w{0, 1}));
}

inline Vec3w point_on(const Disk& disk, Random& random) {
  return widen(disk.center) + static_cast<Wide>(disk.radius) * on_circle(widen(disk.normal), extreme_or_random(random));
}

inline Vec3w point_on(const Cone& cone, Random& random) {
  const Wide mix = random.bits() % 2 ? random.uniform(0, 1) : static_cast<double>(random.bits() % 2);
  const Vec3w axis = widen(cone.apex) - widen(cone.base);
  const Wide radius = cone.base_radius + mix * (static_cast<Wide>(cone.apex_radius) - cone.base_radius);
  return widen(cone.base) + mix * axis + radius * on_circle(axis, extreme_or_random(random));
}

inline Vec3w point_on(const Cylinder& c, Random& random) {
  return point_on(Cone{c.base, c.radius, c.apex, c.radius}, random);
}

}  // namespace tessera

#pragma once

#include "core/geometry/cone.h"
#include "core/geometry/cylinder.h"
#include "core/geometry/disk.h"
#include "core/geometry/sphere.h"
#include "tests/support/random.h"

namespace tessera {

/// The primitive of a seed: sizes 1e-6 … 1e6, up to 1e7 times that away from the world's origin (so that size and
/// place still fit into floats together), cones and cylinders from 1:1e7 flat to 1e7:1 long.
template <typename Primitive>
Primitive make(Random& random);

inline Vec3 some_place(Random& random, double size) {
  const double far = random.uniform(0, 1) < 0.3 ? 0 : random.magnitude(-3, 5);
  return to_float(size * far * random.in_cube());
}

template <>
inline Sphere make(Random& random) {
  const double radius = random.magnitude(-6, 6);
  return {some_place(random, radius), static_cast<float>(radius)};
}

template <>
inline Disk make(Random& random) {
  const double radius = random.magnitude(-6, 6);
  return {some_place(random, radius), *UnitVec3::normalize(random.direction()), static_cast<float>(radius)};
}

template <>
inline Cone make(Random& random) {
  const double radius = random.magnitude(-6, 6);
  const Vec3 base = some_place(random, radius);
  Vec3 apex = base;
  while (apex == base) apex = to_float(to_double(base) + radius * random.magnitude(-7, 7) * random.direction());
  const auto r = static_cast<float>(radius), smaller = static_cast<float>(radius * random.uniform(0, 1));
  switch (random.bits() % 4) {
    case 0:
      return {base, r, apex, 0};
    case 1:
      return {base, 0, apex, r};
    case 2:
      return {base, smaller, apex, r};
    default:
      return {base, r, apex, smaller};
  }
}

template <>
inline Cylinder make(Random& random) {
  const Cone cone = make<Cone>(random);
  return {cone.base, cone.apex, std::max(cone.base_radius, cone.apex_radius)};
}

/// A ray from 1e-3 to 1e7 sizes away at a point in or beside the box, of length 1e-20 to 1e20.
inline Ray make_ray(Random& random, const Aabb& box) {
  const Vec3d middle = 0.5 * (to_double(box.lo) + to_double(box.hi)), half = to_double(box.hi) - middle;
  const Vec3d offset = random.in_cube();
  const Vec3d target = middle + 1.1 * Vec3d{offset.x * half.x, offset.y * half.y, offset.z * half.z};
  const Vec3d from = random.direction();
  const Vec3 origin = to_float(target + (length(half) * random.magnitude(-3, 7)) * from);
  Vec3d d = target - to_double(origin);
  if (length(d) == 0) d = -from;
  return {origin, to_float((random.magnitude(-20, 20) / length(d)) * d)};
}

/// A point and a direction there that the primitive's solver finds hard.
struct Line {
  Vec3d point, direction;
};

/// Tangent to the sphere.
inline Line awkward_line(const Sphere& sphere, Random& random) {
  const Vec3d n = random.direction();
  return {to_double(sphere.center) + static_cast<double>(sphere.radius) * n, cross(n, random.direction())};
}

/// In the disk's plane.
inline Line awkward_line(const Disk& disk, Random& random) {
  const Vec3d tangent = cross(to_double(disk.normal), random.direction());
  return {to_double(disk.center) + disk.radius * random.uniform(0, 1) * tangent, tangent};
}

/// Along the axis or the slant, tangent, in the tangent plane; at a tip or a rim as often as in between.
inline Line awkward_line(const Cone& cone, Random& random) {
  const Vec3d base = to_double(cone.base), apex = to_double(cone.apex), axis = apex - base;
  const Vec3d turned = cross(axis, random.direction());
  if (length(turned) == 0) return {base, axis};
  const Vec3d side = turned / length(turned);
  const Vec3d low = base + static_cast<double>(cone.base_radius) * side;
  const Vec3d slant = apex + static_cast<double>(cone.apex_radius) * side - low;
  const double mix = random.bits() % 3 == 0 ? static_cast<double>(random.bits() % 2) : random.uniform(0, 1);
  const Vec3d point = low + mix * slant;
  switch (random.bits() % 6) {
    case 0:
      return {point, axis};
    case 1:
      return {point, slant};
    case 2:
      return {point, cross(side, axis)};
    case 3:
      return {point, slant + random.uniform(-1, 1) * cross(side, slant)};
    case 4:
      return {point, random.direction()};
    default:
      return {base + random.uniform(0, 1) * axis, random.direction()};
  }
}
inline Line awkward_line(const Cylinder& c, Random& random) {
  return awkward_line(Cone{c.base, c.radius, c.apex, c.radius}, random);
}

}  // namespace tessera

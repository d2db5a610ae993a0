#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "core/bounds/box_bound.h"
#include "core/bounds/hull_bound.h"
#include "core/bounds/slab_bound.h"
#include "core/bounds/sphere_bound.h"
#include "tests/support/random.h"
#include "tests/support/wide.h"

namespace tessera {

/// The kinds of bounds under test, each with a way to make one and to tell how far outside of a volume a point lies
/// (≤ 0 inside), in wider precision.
struct Boxes {
  using B = BoxBound;
  static B make(Random&) { return {}; }
  static Wide outside(const B&, const Aabb& box, Vec3w p) { return tessera::outside(box, p); }
};

struct Spheres {
  using B = SphereBound;
  static B make(Random&) { return {}; }
  static Wide outside(const B&, const BoundingSphere& s, Vec3w p) {
    const Vec3w v = p - widen(s.center);
    return std::sqrt(dot(v, v)) - s.radius;
  }
};

/// Normals as users give them: of any length and number, some parallel, some not spanning space.
struct SlabNormals {
  static std::vector<Vec3> make(Random& random) {
    if (random.bits() % 2) return slab_preset(kSlabPresets[random.bits() % kSlabPresets.size()]);
    std::vector<Vec3> normals;
    const std::size_t count = 1 + random.bits() % (random.bits() % 4 ? 8 : kMostNormals);
    while (normals.size() < count) {
      const Vec3d n = random.magnitude(-20, 20) * random.direction();
      normals.push_back(!normals.empty() && random.bits() % 4 == 0 ? normals.back() : to_float(n));
    }
    return normals;
  }
};

/// A bound that remembers its normals, which the oracle has to know.
struct KnownSlabs : SlabBound {
  explicit KnownSlabs(std::vector<Vec3> n) : SlabBound(n), normals(std::move(n)) {}
  std::vector<Vec3> normals;
};

struct SlabsOfUsers {
  using B = KnownSlabs;
  static B make(Random& random) { return B(SlabNormals::make(random)); }
  static Wide outside(const B& bound, const Slabs& slabs, Vec3w p) {
    Wide worst = -kInfinity;
    for (std::size_t i = 0; i < slabs.size(); ++i) {
      // The bound scales its normals by powers of two, so that the largest component is in [1/2, 1).
      const Vec3w n = widen(bound.normals[i]);
      int exponent;
      std::frexp(max_component(abs(n)), &exponent);
      const Wide at = std::ldexp(dot(n, p), -exponent);
      worst = std::max({worst, slabs[i].lo - at, at - slabs[i].hi});
    }
    return worst;
  }
};

struct Hulls {
  using B = HullBound;
  static B make(Random& random) { return {static_cast<std::uint32_t>(random.bits() % 2 ? 24 : 4)}; }
  static Wide outside(const B&, const Polytope& polytope, Vec3w p) {
    Wide worst = tessera::outside(polytope.box, p);
    for (const HalfSpace& plane : polytope.planes) worst = std::max(worst, dot(widen(plane.normal), p) - plane.offset);
    return worst;
  }
};

/// 1 to 40 points: at random, or degenerate in one of the ways that point sets are.
inline std::vector<Vec3d> make_shape(Random& random) {
  const std::size_t count = 1 + random.bits() % 40;
  const Vec3d a = random.in_cube(), b = random.in_cube(), c = random.in_cube();
  const auto kind = random.bits() % 8;
  std::vector<Vec3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double s = random.uniform(-1, 1), t = random.uniform(-1, 1);
    switch (kind) {
      case 0:  // all duplicates
        points.push_back(a);
        break;
      case 1:  // on a line
        points.push_back(a + s * b);
        break;
      case 2:  // in a plane
        points.push_back(a + s * b + t * c);
        break;
      case 3:  // on a sphere
        points.push_back(random.direction());
        break;
      case 4:  // on a small grid: many in a plane, on a line, equal
        points.push_back({std::round(s * 2), std::round(t * 2), std::round(random.uniform(-2, 2))});
        break;
      case 5:  // a needle
        points.push_back({s, t * 1e-6, random.uniform(-1e-6, 1e-6)});
        break;
      default:
        points.push_back(random.in_cube());
    }
  }
  return points;
}

/// The set of a seed: at scale 1, tiny, huge, or far away for its size.
inline std::vector<Vec3> make_points(Random& random) {
  const auto where = random.bits() % 6;
  const double scale = where == 0 ? 1e15 : where == 1 ? 1e-15 : where == 2 ? random.magnitude(-30, 30) : 1;
  const Vec3d offset = where == 3 || where == 4 ? random.magnitude(5, 8) * random.in_cube() : Vec3d{};
  std::vector<Vec3> points;
  for (const Vec3d p : make_shape(random)) points.push_back(to_float(scale * p + offset));
  return points;
}

inline Aabb box_of(const std::vector<Vec3>& points) {
  Aabb box;
  for (const Vec3 p : points) box.extend(p);
  return box;
}

inline Outline outline_of(const std::vector<Vec3>& points) { return {points, {}, 0}; }

/// The distance from a point to a triangle.
inline Wide distance(const std::array<Vec3, 3>& triangle, Vec3w p) {
  const Vec3w a = widen(triangle[0]), b = widen(triangle[1]), c = widen(triangle[2]);
  const auto to_segment = [&](Vec3w from, Vec3w to) {
    const Vec3w e = to - from;
    const Wide ee = dot(e, e);
    const Wide s = ee > 0 ? std::clamp(dot(p - from, e) / ee, 0.0L, 1.0L) : 0;
    const Vec3w v = p - (from + s * e);
    return std::sqrt(dot(v, v));
  };
  const Wide rim = std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
  const Vec3w n = cross(b - a, c - a);
  const bool above = dot(cross(b - a, p - a), n) >= 0 && dot(cross(c - b, p - b), n) >= 0 &&
                     dot(cross(a - c, p - c), n) >= 0 && dot(n, n) > 0;
  return above ? std::min(rim, std::abs(dot(p - a, n)) / std::sqrt(dot(n, n))) : rim;
}

}  // namespace tessera

#pragma once

#include "core/math/rounding.h"
#include "core/math/vec.h"

namespace tessera {

/// A closed axis-aligned box; empty (lo > hi) by default. `extend` with a NaN coordinate leaves that axis alone.
struct Aabb {
  Vec3 lo{kInfinity, kInfinity, kInfinity};
  Vec3 hi{-kInfinity, -kInfinity, -kInfinity};

  constexpr bool operator==(const Aabb&) const = default;
  constexpr bool empty() const { return !(lo.x <= hi.x && lo.y <= hi.y && lo.z <= hi.z); }

  constexpr void extend(Vec3 p) {
    lo = min(lo, p);
    hi = max(hi, p);
  }
  constexpr void extend(const Aabb& b) {
    lo = min(lo, b.lo);
    hi = max(hi, b.hi);
  }
  constexpr bool contains(Vec3 p) const {
    return lo.x <= p.x && p.x <= hi.x && lo.y <= p.y && p.y <= hi.y && lo.z <= p.z && p.z <= hi.z;
  }
  constexpr bool contains(const Aabb& b) const { return b.empty() || (contains(b.lo) && contains(b.hi)); }
  constexpr Vec3 diagonal() const { return hi - lo; }
  constexpr Vec3 center() const { return lo * 0.5F + hi * 0.5F; }
};

/// Half the surface area: what the surface area heuristic compares. 0 for an empty box. In double, so that neither
/// kilometre nor nanometre scenes leave the range.
constexpr double half_area(const Aabb& b) {
  if (b.empty()) return 0;
  const Vec3d d = to_double(b.hi) - to_double(b.lo);
  return d.x * d.y + d.y * d.z + d.z * d.x;
}

/// A box with float bounds that holds [lo, hi] given in double: the nearest floats, one ulp further out.
Aabb outward(Vec3d lo, Vec3d hi);

}  // namespace tessera

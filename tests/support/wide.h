#pragma once

#include <cmath>

#include "core/bounds/aabb.h"
#include "core/math/ray.h"

namespace tessera {

/// Wider precision for oracles: 11 bits more than the double of the code under test.
using Wide = long double;
using Vec3w = Vec<Wide>;

constexpr Vec3w widen(Vec3 v) { return {v.x, v.y, v.z}; }
constexpr Vec3w widen(Vec3d v) { return {v.x, v.y, v.z}; }

/// The point that a float t stands for, exact but for 2^-63.
constexpr Vec3w point_at(const Ray& ray, float t) {
  return widen(ray.origin) + static_cast<Wide>(t) * widen(ray.direction);
}

/// The M of the culling contract: the greatest coordinate distance from the ray's origin to a corner of the box.
inline Wide reach(const Aabb& box, const Ray& ray) {
  return std::max(max_component(abs(widen(box.lo) - widen(ray.origin))),
                  max_component(abs(widen(box.hi) - widen(ray.origin))));
}

/// How far outside the box a point lies, along the worst axis; ≤ 0 inside.
inline Wide outside(const Aabb& box, Vec3w p) { return max_component(max(widen(box.lo) - p, p - widen(box.hi))); }

/// The distance between neighbouring floats at |v|.
inline Wide ulp(Wide v) {
  const auto f = static_cast<float>(std::abs(v));
  return static_cast<Wide>(std::nextafter(f, kInfinity)) - f;
}

}  // namespace tessera

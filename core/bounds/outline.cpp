#include "core/bounds/outline.h"

#include <algorithm>
#include <cmath>

namespace tessera {

void Outline::append(const Outline& other) {
  points.insert(points.end(), other.points.begin(), other.points.end());
  ellipsoids.insert(ellipsoids.end(), other.ellipsoids.begin(), other.ellipsoids.end());
  slack = std::max(slack, other.slack);
}

Extent extent_along(Vec3d n, const Outline& outline) {
  if (outline.empty()) return {};
  Extent extent;
  double largest = 0;
  const auto add = [&](Vec3d center, double radius) {
    const double at = dot(n, center);
    extent.lo = std::min(extent.lo, at - radius);
    extent.hi = std::max(extent.hi, at + radius);
    largest = std::max(largest, max_component(abs(center)));
  };
  for (const Vec3 p : outline.points) add(to_double(p), 0);
  for (const Ellipsoid& e : outline.ellipsoids) {
    const Vec3d along{dot(n, e.axes[0]), dot(n, e.axes[1]), dot(n, e.axes[2])};
    add(e.center, length(along));
    for (const Vec3d axis : e.axes) largest = std::max(largest, max_component(abs(axis)));
  }
  // A dot product of three terms, a length, their sum: some ten roundings of at most 2^-53 · |n|₁ · 4 · largest.
  const double n1 = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
  const double wider = n1 * (largest * 0x1p-48 + outline.slack);
  return {extent.lo - wider, extent.hi + wider};
}

}  // namespace tessera

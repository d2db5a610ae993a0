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
  std::size_t item = 0;
  const auto add = [&](double lo, double hi) {
    if (lo < extent.lo) extent.lo = lo, extent.lowest = item;
    if (hi > extent.hi) extent.hi = hi, extent.highest = item;
    ++item;
  };
  for (const Vec3 p : outline.points) {
    const double at = dot(n, to_double(p));
    add(at, at);
  }
  for (const Ellipsoid& e : outline.ellipsoids) {
    const double at = dot(n, e.center), radius = length(Vec3d{dot(n, e.axes[0]), dot(n, e.axes[1]), dot(n, e.axes[2])});
    add(at - radius, at + radius);
  }
  const double n1 = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
  const double wider = n1 * (extent_rounding(outline) + outline.slack);
  extent.lo -= wider;
  extent.hi += wider;
  return extent;
}

/// A dot product of three terms, for an ellipsoid a length and a sum: some ten roundings of at most 2^-53 · 2.
double extent_rounding(const Outline& outline) {
  double largest = 0;
  for (const Vec3 p : outline.points) largest = std::max<double>(largest, max_component(abs(p)));
  for (const Ellipsoid& e : outline.ellipsoids)
    for (const Vec3d v : {e.center, e.axes[0], e.axes[1], e.axes[2]})
      largest = std::max(largest, max_component(abs(v)));
  return largest * 0x1p-48;
}

void keep(Outline& outline, const std::vector<bool>& marked) {
  std::size_t item = 0;
  const auto thin = [&](auto& items) {
    std::size_t kept = 0;
    for (const auto& each : items)
      if (marked[item++]) items[kept++] = each;
    items.resize(kept);
  };
  thin(outline.points);
  thin(outline.ellipsoids);
}

/// The square of the longest half axis is the largest eigenvalue of the axes' Gram matrix, which no sum of a row's
/// absolute values falls below (Gershgorin). Rounds by less than 2^-49.
double bounding_radius(const Ellipsoid& ellipsoid) {
  double most = 0;
  for (const Vec3d a : ellipsoid.axes) {
    double sum = 0;
    for (const Vec3d b : ellipsoid.axes) sum += std::abs(dot(a, b));
    most = std::max(most, sum);
  }
  return std::sqrt(most) * (1 + 0x1p-49);
}

}  // namespace tessera

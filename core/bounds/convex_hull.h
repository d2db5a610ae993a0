#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math/vec.h"

namespace tessera {

/// The convex hull of points, by their indices.
struct ConvexHull {
  /// All extreme points, each once, and in three dimensions perhaps some that lie within a facet or an edge of it. Two
  /// ends of a line; around a polygon in order.
  std::vector<std::uint32_t> vertices;

  /// Triangles, counter-clockwise seen from outside, none of them without area. Closed: every edge is shared by exactly
  /// two, which run along it in opposite directions. A flat hull is a polygon with two sides; a line or a point has
  /// none.
  std::vector<std::array<std::uint32_t, 3>> faces;

  int dimension = -1;  ///< 0 to 3; −1 without points.
};

/// Quickhull (Barber, Dobkin & Huhdanpaa 1996) with exact predicates: right for any finite points, be they equal, on a
/// line, in a plane or on a sphere. The same for the same points in the same order.
ConvexHull convex_hull(std::span<const Vec3> points);

}  // namespace tessera

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "proto/wire/abandoned.h"

namespace tessera::proto {

/// Cuts a simple polygon, flat or nearly so, convex or not, into triangles that tile it, turned like it, and appends
/// them. Needs at least 3 corners, all in range of `positions`.
///
/// The triangles' corners are the polygon's, by index: n corners make n − 2 triangles, each side of the polygon is
/// the side of exactly one, also where three corners lie on a line; so meshes stay watertight. Corners at the place
/// of their predecessor are left out. A fan from the first corner where that tiles the polygon (always when it is
/// convex), otherwise ear clipping (Meisters 1975; tests as in Held 2001, "FIST"). A polygon that crosses itself
/// still gives n − 2 triangles over its corners, some of them turned over.
///
/// Takes O(n) searches of a k-d tree: near O(n log n), and O(n√n) where most cuts are long and thin. False, and nothing
/// is added, with a corner that is NaN, infinite or beyond `kLargestCoordinate`. Throws `Abandoned` by way of `steps`.
bool triangulate(std::span<const Vec3> positions, std::span<const std::uint32_t> corners,
                 std::vector<TriangleIndices>& triangles, Steps& steps);

/// Twice the area vector by Newell's method (Sutherland et al. 1974): along the normal of the side from which the
/// corners run counter-clockwise. Zero for a polygon without area; NaN or infinite with a corner that is.
Vec3d area_vector(std::span<const Vec3> positions, std::span<const std::uint32_t> corners);

/// In radians, 0 to π; 0 where one has no length.
double angle_between(Vec3d a, Vec3d b);

}  // namespace tessera::proto

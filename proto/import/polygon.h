#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "proto/abandoned.h"

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
/// Takes at most some n steps, each a search for corners in a triangle. False, and nothing is added, with a corner that
/// is NaN, infinite or beyond `kLargestCoordinate`.
bool triangulate(std::span<const Vec3> positions, std::span<const std::uint32_t> corners,
                 std::vector<TriangleIndices>& triangles, Steps& steps);

/// Twice the area vector by Newell's method (Sutherland et al. 1974): along the normal of the side from which the
/// corners run counter-clockwise. Zero for a polygon without area; NaN or infinite with a corner that is.
Vec3d area_vector(std::span<const Vec3> positions, std::span<const std::uint32_t> corners);

}  // namespace tessera::proto

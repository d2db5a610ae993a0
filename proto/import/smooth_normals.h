#pragma once

#include <span>
#include <stop_token>

#include "core/geometry/triangle_mesh.h"
#include "proto/import/import.h"
#include "proto/wire/abandoned.h"

namespace tessera::proto {

/// Gives meshes without normals smooth ones: at each place where triangles meet, those that hang together over edges
/// which bend by at most `degrees` (0 to 180) share a normal, the mean of theirs weighted by their angle there (Thürmer
/// & Wüthrich 1998). Edges that bend by more stay sharp: vertices are doubled there, with their attributes. So do those
/// of more than two triangles. What counts is where vertices are, whatever mesh they belong to.
///
/// The meshes are such as `drop_unusable_triangles` leaves. O(n log n). Throws `Abandoned` by way of `steps`,
/// std::length_error beyond 2^32 corners.
void smooth_normals(std::span<TriangleMesh* const> meshes, float degrees, Steps& steps);

/// The same of all that a file brought without normals: together, unless the file places its parts here and there.
void smooth_normals(Imported& file, float degrees, const std::stop_token& stop);

}  // namespace tessera::proto

#pragma once

#include <cstddef>

#include "core/geometry/triangle_mesh.h"
#include "proto/import/import_notes.h"

namespace tessera::proto {

/// The last step of every imported mesh: drops triangles that no ray can hit, and gives vertices whose normal has no
/// direction (zero, NaN, infinite) the one of the triangles around them. Counts both in `notes`, at `line`.
void repair_mesh(TriangleMesh& mesh, ImportNotes& notes, std::size_t line = 0);

/// Counts a polygon of `corners` corners that couldn't be cut into triangles because one isn't finite.
void note_lost_polygon(std::size_t corners, ImportNotes& notes, std::size_t line);

}  // namespace tessera::proto

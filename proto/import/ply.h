#pragma once

#include <stop_token>
#include <string_view>

#include "proto/import/import.h"

namespace tessera::proto {

/// Reads a PLY file of any encoding into one mesh without a material (none when it has no triangles). Throws
/// `BrokenFile`.
///
/// Read are x y z and nx ny nz of "vertex", and the lists vertex_indices (or vertex_index) of "face" (polygons of
/// any size) and of "tristrips" (as Stanford's: every other triangle turned over, −1 starts a new strip). Elements
/// and properties beside these are skipped and named in a warning. Faces, and triangles of strips, that name vertices
/// which aren't there are dropped and counted; a file with faces of which none can be used is refused.
Imported import_ply(std::string_view bytes, std::string_view file_name, std::stop_token stop = {});

}  // namespace tessera::proto

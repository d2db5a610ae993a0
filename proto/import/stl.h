#pragma once

#include <stop_token>
#include <string_view>

#include "proto/import/import.h"

namespace tessera::proto {

/// Reads an STL file, binary or text (3D Systems, "StereoLithography Interface Specification", 1989), into one mesh
/// without a material; none when it has no triangles. Throws `BrokenFile`.
///
/// It is binary when its size is what its count says, or when it doesn't begin with "solid" as text does. Corners in
/// one place are one vertex; the order of corners says where outside is, and the normals that are written are ignored,
/// as are colours in binary's spare bytes. All solids of a text become one mesh.
Imported import_stl(std::string_view bytes, std::string_view file_name, std::stop_token stop = {});

}  // namespace tessera::proto

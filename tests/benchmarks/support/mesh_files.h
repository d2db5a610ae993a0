#pragma once

#include <filesystem>

#include "core/geometry/triangle_mesh.h"

namespace tessera::bench {

/// How the corners of an OBJ file's faces are written; `v_vt_vn` brings texture coordinates, of which there are none in
/// a mesh, and both others but `v` need normals.
enum class ObjCorners { v, v_vn, v_vt_vn };
enum class PlyBody { ascii, little_endian };

/// Write a mesh as exporters do, numbers with as many digits as tell floats apart. Throw std::runtime_error when that
/// fails.
void write_obj(const TriangleMesh& mesh, ObjCorners corners, const std::filesystem::path& path);
void write_ply(const TriangleMesh& mesh, PlyBody body, const std::filesystem::path& path);

}  // namespace tessera::bench

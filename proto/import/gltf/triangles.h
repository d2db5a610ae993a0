#pragma once

#include <optional>

#include "core/geometry/triangle_mesh.h"
#include "proto/import/gltf/meshes.h"

namespace tessera::proto {

/// A mesh and what `TriangleMesh` keeps beside it, while both may still change.
struct GltfTriangles {
  TriangleMesh mesh;
  MeshAttributes attributes;
  std::vector<std::array<float, 4>> joints = {};   ///< Of a mesh with a skin: which joints, whole numbers,
  std::vector<std::array<float, 4>> weights = {};  ///< and how much of each.
};

/// The triangles of a primitive that is a surface, with the attributes of their vertices, as they stand in the file:
/// indices are in range, all else may be anything. Nothing, with an error, where they can't be had.
std::optional<GltfTriangles> read_triangles(const Primitive& primitive, Accessors& accessors, GltfBuffers& buffers,
                                            GltfFile& file);

}  // namespace tessera::proto

#pragma once

#include <optional>

#include "proto/import/gltf/triangles.h"

namespace tessera::proto {

/// The triangles of a primitive that is compressed with Draco (KHR_draco_mesh_compression). Nothing, with an error,
/// where the data is broken or isn't what the accessors say.
std::optional<GltfTriangles> read_draco(const Primitive& primitive, Accessors& accessors, GltfBuffers& buffers,
                                        GltfFile& file);

}  // namespace tessera::proto

#pragma once

#include <cstdint>
#include <stop_token>
#include <string_view>

#include "proto/import/import.h"

namespace tessera::proto {

/// Reads a glTF 2.0 file, .gltf or .glb, told by its content: the meshes, materials, lights and cameras of one scene.
/// Throws `BrokenFile` whose errors point into the document, "name/accessors/3/count": what glTF's specification
/// forbids, and required extensions that aren't known. What is left out is noted.
///
/// A part is a primitive of a mesh. One that is seen once is taken to the world; one that is seen more often, as it
/// is or with other materials, stands in its own space and has a placement for each. Meshes stand as skins and nodes
/// put them before any animation.
Imported import_gltf(std::string_view bytes, std::string_view file_name, const CompanionSource& companions,
                     const ImportOptions& options, std::uint64_t texture_bytes, const std::stop_token& stop = {});

}  // namespace tessera::proto

#pragma once

#include <span>

#include "proto/import/gltf/nodes.h"
#include "proto/import/gltf/triangles.h"

namespace tessera::proto {

/// Takes a mesh to the world: in double, rounded once. Where the map mirrors, triangles are turned over, so that their
/// fronts stay fronts.
void bake(GltfTriangles& triangles, const Rows& to_world, Steps& steps);

/// The same for a mesh with a skin: each vertex by the mean of its joints' maps. Joints may mirror some parts of a mesh
/// alone, so each triangle is turned over where the maps of most of its corners mirror. False where a vertex names a
/// joint that isn't there.
bool bake_skin(GltfTriangles& triangles, std::span<const Rows> joints, Steps& steps);

}  // namespace tessera::proto

#pragma once

#include "proto/import/gltf/nodes.h"
#include "proto/import/gltf/triangles.h"

namespace tessera::proto {

/// Takes a mesh to the world: in double, rounded once. Where the map mirrors, triangles are turned over, so that their
/// fronts stay fronts.
void bake(GltfTriangles& triangles, const Rows& to_world, Steps& steps);

}  // namespace tessera::proto

#pragma once

#include "core/geometry/triangle_mesh.h"
#include "core/scene/camera.h"

namespace tessera::bench {

/// Six rooms in a row, 48 m long, turned by 30° against the axes: floors, walls and beams of long thin triangles,
/// arches, columns, tables, chairs, books and vases of small ones.
struct Interior {
  TriangleMesh mesh;
  PerspectiveCamera camera;  ///< In the first room, looking through all arches.
  Vec3 light;                ///< Below the ceiling of the second room.
};
Interior interior();

}  // namespace tessera::bench

#pragma once

#include <cstdint>
#include <variant>

#include "core/bounds/aabb.h"
#include "core/geometry/cone.h"
#include "core/geometry/cylinder.h"
#include "core/geometry/disk.h"
#include "core/geometry/quad.h"
#include "core/geometry/sphere.h"
#include "core/geometry/triangle_mesh.h"

namespace tessera {

/// Everything that can be placed in a scene. A mesh is many primitives, every other shape is one.
using Shape = std::variant<TriangleMesh, Sphere, Cylinder, Cone, Disk, Quad>;

std::uint32_t primitive_count(const Shape& shape);

/// The box of the whole shape; empty for a mesh without triangles. Vertices that no triangle uses don't count.
Aabb bounds(const Shape& shape);

}  // namespace tessera

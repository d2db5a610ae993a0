#pragma once

#include <cstdint>

#include "core/geometry/triangle_mesh.h"

namespace tessera::bench {

/// A closed body of about that many triangles around the origin: a sphere displaced along its radii by six octaves of
/// noise, the shape the same for any number. All of it lies more than 0.2 and less than 2 from the origin, so that
/// what starts near the origin is inside.
TriangleMesh organic(std::uint32_t triangles);

/// One mesh of 820 spheres of 1280 triangles each: Haines' sphereflake, a sphere with nine of a third of its size on
/// it, three times over.
TriangleMesh mesh_flake();

/// Adds a copy of `part`, scaled about its origin and moved there.
void append(TriangleMesh& mesh, const TriangleMesh& part, double scale, Vec3d center);

}  // namespace tessera::bench

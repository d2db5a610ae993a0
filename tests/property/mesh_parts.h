#pragma once

#include <cstdint>

#include "core/geometry/triangle_mesh.h"

namespace tessera {

/// The mesh, larger and then moved, each coordinate rounded once.
inline TriangleMesh scaled(TriangleMesh mesh, double scale, Vec3d offset = {}) {
  for (Vec3& p : mesh.positions) p = to_float(to_double(p) * scale + offset);
  return mesh;
}

/// Adds a triangle with corners of its own.
inline void add(TriangleMesh& mesh, Vec3d a, Vec3d b, Vec3d c) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vec3d p : {a, b, c}) mesh.positions.push_back(to_float(p));
  mesh.triangles.push_back({first, first + 1, first + 2});
}

}  // namespace tessera

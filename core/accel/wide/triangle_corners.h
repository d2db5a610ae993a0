#pragma once

#include <array>
#include <cstdint>

#include "core/accel/wide/lanes.h"
#include "core/geometry/triangle_mesh.h"

namespace tessera {

using Corners = std::array<Lanes, 3>;

inline Corners corners_of(const TriangleMesh& mesh, std::uint32_t triangle) {
  const auto corner = [&](std::size_t i) {
    const Vec3& p = mesh.positions[mesh.triangles[triangle][i]];
    return Lanes{p.x, p.y, p.z, 0};
  };
  return {corner(0), corner(1), corner(2)};
}

}  // namespace tessera

#pragma once

#include <array>
#include <cstdint>

#include "core/accel/wide/lanes.h"
#include "core/geometry/triangle_mesh.h"

namespace tessera {

using Corners = std::array<Lanes, 3>;
Corners corners_of(const TriangleMesh& mesh, std::uint32_t triangle);

/// Boxes of the parts of a triangle on the two sides of a plane across an axis; both sides have what lies in the plane.
/// They hold the exact parts: roundings are outward.
struct TriangleCut {
  LanesBox below = LanesBox::empty(), above = LanesBox::empty();

  TriangleCut(const Corners& corners, int axis, float plane);
};

}  // namespace tessera

#pragma once

#include "core/accel/wide/triangle_corners.h"

namespace tessera {

/// Boxes of the parts of a triangle on the two sides of a plane across an axis; both sides have what lies in the plane.
/// They hold the exact parts: roundings are outward.
struct TriangleCut {
  LanesBox below = LanesBox::empty(), above = LanesBox::empty();

  TriangleCut(const Corners& corners, int axis, float plane);
};

}  // namespace tessera

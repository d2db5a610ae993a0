#include "core/bounds/aabb.h"

#include <cmath>

namespace tessera {

Aabb outward(Vec3d lo, Vec3d hi) {
  Aabb box;
  for (int axis = 0; axis < 3; ++axis) {
    box.lo[axis] = std::nextafter(static_cast<float>(lo[axis]), -kInfinity);
    box.hi[axis] = std::nextafter(static_cast<float>(hi[axis]), kInfinity);
  }
  return box;
}

}  // namespace tessera

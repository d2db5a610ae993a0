#pragma once

#include <cmath>

#include "core/math/vec.h"

namespace tessera {

/// Half the size, per axis, of the box around a circle of radius 1 that lies across `axis` (not zero, any length):
/// sqrt(1 − a_i²) for the unit axis a, from the other two components so that nothing cancels. Rounded up: its
/// five roundings, and the one of its product with a radius, stay below 2^-49 relative.
inline Vec3d circle_extent(Vec3d axis) {
  const Vec3d squared{axis.x * axis.x, axis.y * axis.y, axis.z * axis.z};
  const double sum = squared.x + squared.y + squared.z;
  const auto extent = [&](double p, double q) { return std::sqrt((p + q) / sum) * (1 + 0x1p-49); };
  return {extent(squared.y, squared.z), extent(squared.z, squared.x), extent(squared.x, squared.y)};
}

}  // namespace tessera

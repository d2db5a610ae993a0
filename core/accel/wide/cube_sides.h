#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math/ray.h"

namespace tessera {

/// Rays to one point that come through one side of a cube around it, so that they fit one picture, and their answers.
struct CubeSide {
  std::vector<Ray> rays;
  std::vector<std::uint8_t> hidden;
  std::vector<std::size_t> places;  ///< Where they stood before.
};

/// Deals those of `rays` that aren't hidden yet, and that anything can hide; they keep their order.
inline std::array<CubeSide, 6> by_cube_sides(std::span<const Ray> rays, std::span<const std::uint8_t> hidden) {
  std::array<CubeSide, 6> sides;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (hidden[i] || !is_traceable(rays[i])) continue;
    const Vec3 way = rays[i].direction, size = abs(way);
    const std::size_t axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    CubeSide& side = sides[2 * axis + std::signbit(way[static_cast<int>(axis)])];
    side.rays.push_back(rays[i]);
    side.hidden.push_back(0);
    side.places.push_back(i);
  }
  return sides;
}

}  // namespace tessera

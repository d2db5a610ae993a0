#pragma once

#include <cmath>
#include <cstdint>

#include "core/geometry/triangle_mesh.h"

namespace tessera::bench {

/// Hills over the unit square, y up: a square grid of about that many triangles, the shape the same for any number.
inline TriangleMesh terrain(std::uint32_t triangles) {
  const auto side = static_cast<std::uint32_t>(std::lround(std::sqrt(triangles / 2.0)));
  TriangleMesh mesh;
  for (std::uint32_t row = 0; row <= side; ++row)
    for (std::uint32_t column = 0; column <= side; ++column) {
      const double x = column / static_cast<double>(side), z = row / static_cast<double>(side);
      double y = 0;
      for (int octave = 0; octave < 6; ++octave) {
        const double f = 6.0 * (1 << octave), turn = 1.7 * octave;
        y += 0.12 / (1 << octave) * std::sin(f * x + 0.6 * f * z + turn) * std::cos(f * z - 0.4 * f * x + 2 * turn);
      }
      mesh.positions.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
    }
  for (std::uint32_t row = 0; row < side; ++row)
    for (std::uint32_t column = 0; column < side; ++column) {
      const std::uint32_t i = row * (side + 1) + column, below = i + side + 1;
      mesh.triangles.push_back({i, below, i + 1});
      mesh.triangles.push_back({i + 1, below, below + 1});
    }
  return mesh;
}

}  // namespace tessera::bench

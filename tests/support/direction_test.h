#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

#include "core/math/vec.h"
#include "tests/support/statistics.h"

namespace tessera {

/// What `test_directions` finds.
struct DirectionTest {
  ChiSquare fit;
  double integral = 0;  ///< Of the density over the sphere: 1, or less by what the sampling is known to lose.
};

namespace direction_test_detail {

struct Cell {
  double z, z_size, phi, phi_size;
};

/// 3 × 3 Gauss-Legendre.
template <class Density>
double gauss(const Density& density, const Cell& cell) {
  constexpr double kAt[] = {0.1127016653792583, 0.5, 0.8872983346207417}, kWeight[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    const double z = cell.z + cell.z_size * kAt[i], radius = std::sqrt(std::max(0.0, 1 - z * z));
    for (int j = 0; j < 3; ++j) {
      const double phi = cell.phi + cell.phi_size * kAt[j];
      sum += kWeight[i] * kWeight[j] *
             static_cast<double>(density(to_float(Vec3d{radius * std::cos(phi), radius * std::sin(phi), z})));
    }
  }
  return sum * cell.z_size * cell.phi_size;  // z and φ: areas of the sphere (Archimedes)
}

template <class Density>
double integrate(const Density& density, const Cell& cell, double whole, double tolerance, int depth) {
  const double z_half = cell.z_size / 2, phi_half = cell.phi_size / 2;
  const Cell parts[] = {{cell.z, z_half, cell.phi, phi_half},
                        {cell.z + z_half, z_half, cell.phi, phi_half},
                        {cell.z, z_half, cell.phi + phi_half, phi_half},
                        {cell.z + z_half, z_half, cell.phi + phi_half, phi_half}};
  double values[4], sum = 0;
  for (int i = 0; i < 4; ++i) sum += values[i] = gauss(density, parts[i]);
  if (depth <= 0 || std::abs(sum - whole) <= tolerance) return sum;
  sum = 0;
  for (int i = 0; i < 4; ++i) sum += integrate(density, parts[i], values[i], tolerance / 2, depth - 1);
  return sum;
}

}  // namespace direction_test_detail

/// Whether directions are drawn with the density that is claimed, by χ² over `rows` × `columns` cells of equal solid
/// angle. `draw(i)` gives draw i of `count`: `std::optional<Vec3>` of unit length, nothing where sampling fails;
/// `density(direction)` gives the density per solid angle, without what is discrete (delta). Failures count as a cell
/// of their own, in which what the density lacks to 1 is expected. Each cell's density is integrated adaptively. A lobe
/// much smaller than a cell (4π / rows / columns) needs more cells.
template <class Draw, class Density>
DirectionTest test_directions(const Draw& draw, const Density& density, int count, int rows = 32, int columns = 64) {
  using direction_test_detail::Cell;
  const auto size = static_cast<std::size_t>(rows * columns) + 1;
  std::vector<double> observed(size), expected(size);
  for (int i = 0; i < count; ++i) {
    const std::optional<Vec3> d = draw(i);
    if (!d) {
      ++observed.back();
      continue;
    }
    const double turn = std::atan2(double{d->y}, double{d->x}) / (2 * std::numbers::pi);
    const int row = std::clamp(static_cast<int>((double{d->z} + 1) / 2 * rows), 0, rows - 1);
    const int column = std::clamp(static_cast<int>((turn < 0 ? turn + 1 : turn) * columns), 0, columns - 1);
    ++observed[static_cast<std::size_t>(row * columns + column)];
  }
  DirectionTest result;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const double z_size = 2.0 / rows, phi_size = 2 * std::numbers::pi / columns;
      double sum = 0;
      // Cut in 16 before anything is trusted, so that a lobe inside a cell is seen.
      for (int part = 0; part < 16; ++part) {
        const Cell cell{-1 + z_size * (row + (part / 4) / 4.0), z_size / 4, phi_size * (column + (part % 4) / 4.0),
                        phi_size / 4};
        sum += direction_test_detail::integrate(density, cell, direction_test_detail::gauss(density, cell),
                                                1e-3 / count, 8);
      }
      expected[static_cast<std::size_t>(row * columns + column)] = sum * count;
      result.integral += sum;
    }
  // Less than the integration's own error isn't a failure that is expected.
  const double lost = 1 - result.integral;
  expected.back() = lost > 1e-5 ? lost * count : 0;
  result.fit = chi_square_test(observed, expected);
  return result;
}

}  // namespace tessera

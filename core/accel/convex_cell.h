#pragma once

#include <utility>
#include <vector>

#include "core/accel/plane.h"
#include "core/bounds/aabb.h"

namespace tessera {

/// A cell of a BSP: a bounded convex polyhedron, by its faces. In double: it says what a cut is worth and which items
/// can be left out of a part, both with room for its rounding; what a ray visits is decided by the planes alone.
class ConvexCell {
 public:
  explicit ConvexCell(const Aabb& box);

  /// The parts below and above the plane; the whole cell is one part where the plane misses it, and the other empty.
  std::pair<ConvexCell, ConvexCell> parts(const FreePlane& plane) const;

  /// Half the surface, as `half_area` of a box.
  double half_surface() const;

  /// Of all faces together: about six times the number of planes that bound the cell.
  std::size_t corner_count() const;

  /// The box of all corners, 2^-40 of the coordinates wider; empty for an empty cell.
  Aabb box() const;

  /// The least and greatest n·p.
  std::pair<double, double> extent(Vec3 n) const;

 private:
  using Polygon = std::vector<Vec3d>;
  ConvexCell() = default;

  std::vector<Polygon> faces_;
};

}  // namespace tessera

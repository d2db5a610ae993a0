#pragma once

#include <cmath>
#include <memory>

#include "core/scene/scene.h"

namespace tessera {

/// Adds `offset` to where things are, and rounds to the floats that there are.
inline void move(Vec3& point, Vec3d offset) { point = to_float(to_double(point) + offset); }
inline void move(TriangleMesh& mesh, Vec3d offset) {
  for (Vec3& p : mesh.positions) move(p, offset);
}
inline void move(Sphere& sphere, Vec3d offset) { move(sphere.center, offset); }
inline void move(Disk& disk, Vec3d offset) { move(disk.center, offset); }
inline void move(Quad& quad, Vec3d offset) {
  for (Vec3& p : quad.corners) move(p, offset);
}
/// Ends that rounding brings together are kept a float apart: no scene has cones without an axis.
template <typename Ended>
requires requires(Ended ended) { ended.apex; }
void move(Ended& cone, Vec3d offset) {
  move(cone.base, offset);
  move(cone.apex, offset);
  if (cone.base == cone.apex) cone.apex.x = std::nextafter(cone.apex.x, kInfinity);
}

/// The scene elsewhere: the shapes themselves are moved, and placed ones are placed about where they were in it, so
/// that far coordinates cancel in their placements.
inline std::shared_ptr<const Scene> moved(Scene scene, Vec3d offset) {
  for (Shape& shape : scene.shapes) std::visit([&](auto& s) { move(s, offset); }, shape);
  for (Object& object : scene.objects) {
    if (!object.placement) continue;
    auto rows = object.placement->rows();
    for (std::size_t i = 0; i < 12; i += 4)
      rows[i + 3] +=
          offset[static_cast<int>(i / 4)] - (rows[i] * offset.x + rows[i + 1] * offset.y + rows[i + 2] * offset.z);
    object.placement = Transform::from_rows(rows);
  }
  return std::make_shared<const Scene>(with_bounds(std::move(scene)));
}

}  // namespace tessera

#pragma once

#include <array>
#include <optional>

#include "core/bounds/aabb.h"
#include "core/geometry/surface_point.h"
#include "core/math/ray.h"

namespace tessera {

/// A flat quadrilateral, counter-clockwise as seen from its front, hit from both sides: the triangles
/// (0, 1, 2) and (0, 2, 3), so that it is watertight against any mesh that shares its corners.
struct Quad {
  std::array<Vec3, 4> corners;
};

std::optional<float> intersect(const Quad& quad, const Ray& ray);
SurfacePoint surface(const Quad& quad, const Ray& ray, float t);
Aabb bounds(const Quad& quad);

}  // namespace tessera

#pragma once

#include <optional>

#include "core/bounds/aabb.h"
#include "core/geometry/surface_point.h"
#include "core/math/ray.h"

namespace tessera {

/// The lateral surface of a cylinder without caps, hit from both sides. `base` ≠ `apex`; `radius` > 0, finite.
struct Cylinder {
  Vec3 base;
  Vec3 apex;
  float radius = 1;
};

/// The smallest t in the ray's open interval whose point lies between base and apex. Computed in double.
std::optional<float> intersect(const Cylinder& cylinder, const Ray& ray);
SurfacePoint surface(const Cylinder& cylinder, const Ray& ray, float t);
Aabb bounds(const Cylinder& cylinder);

}  // namespace tessera

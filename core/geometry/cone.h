#pragma once

#include <optional>

#include "core/bounds/aabb.h"
#include "core/geometry/surface_point.h"
#include "core/math/ray.h"

namespace tessera {

/// The lateral surface of a (truncated) cone without caps, hit from both sides. `base` ≠ `apex`; radii ≥ 0,
/// finite, not both 0. Equal radii make a cylinder.
struct Cone {
  Vec3 base;
  float base_radius = 1;
  Vec3 apex;
  float apex_radius = 0;
};

/// The smallest t in the ray's open interval whose point lies between base and apex. Computed in double.
std::optional<float> intersect(const Cone& cone, const Ray& ray);
SurfacePoint surface(const Cone& cone, const Ray& ray, float t);
Aabb bounds(const Cone& cone);

/// How far from the axis hits are found at an end of this radius: a little farther at a tip (see cone.cpp).
double hit_radius(const Cone& cone, float end_radius);

}  // namespace tessera

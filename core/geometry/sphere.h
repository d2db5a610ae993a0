#pragma once

#include <optional>

#include "core/bounds/aabb.h"
#include "core/geometry/surface_point.h"
#include "core/math/ray.h"

namespace tessera {

/// A sphere surface, hit from both sides. `radius` > 0 and finite.
struct Sphere {
  Vec3 center;
  float radius = 1;
};

/// The smallest t in the ray's open interval, accurate to 2 ulp of the distance travelled at any range (Haines
/// et al., "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems 2019).
std::optional<float> intersect(const Sphere& sphere, const Ray& ray);
SurfacePoint surface(const Sphere& sphere, const Ray& ray, float t);
Aabb bounds(const Sphere& sphere);

}  // namespace tessera

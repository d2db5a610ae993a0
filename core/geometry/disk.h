#pragma once

#include <optional>

#include "core/bounds/aabb.h"
#include "core/geometry/surface_point.h"
#include "core/math/ray.h"
#include "core/math/unit_vec3.h"

namespace tessera {

/// A flat disk, hit from both sides. `radius` > 0 and finite.
struct Disk {
  Vec3 center;
  UnitVec3 normal = UnitVec3::z();
  float radius = 1;
};

/// t where the ray crosses the disk's plane, if that lies in the ray's open interval and within the radius.
/// A ray in the plane misses.
std::optional<float> intersect(const Disk& disk, const Ray& ray);
SurfacePoint surface(const Disk& disk, const Ray& ray, float t);
Aabb bounds(const Disk& disk);

}  // namespace tessera

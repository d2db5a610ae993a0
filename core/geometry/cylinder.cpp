#include "core/geometry/cylinder.h"

#include "core/geometry/cone.h"

namespace tessera {
namespace {

/// A cone that doesn't widen: every term with the difference of the radii is exactly 0, which leaves the
/// cylinder's own equation. So the two kinds agree to the bit.
Cone as_cone(const Cylinder& cylinder) { return {cylinder.base, cylinder.radius, cylinder.apex, cylinder.radius}; }

}  // namespace

std::optional<float> intersect(const Cylinder& cylinder, const Ray& ray) { return intersect(as_cone(cylinder), ray); }

SurfacePoint surface(const Cylinder& cylinder, const Ray& ray, float t) { return surface(as_cone(cylinder), ray, t); }

Aabb bounds(const Cylinder& cylinder) { return bounds(as_cone(cylinder)); }

}  // namespace tessera

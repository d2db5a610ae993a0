#include "core/integrator/shading.h"

#include "core/material/shade.h"

namespace tessera {

Shading::Shading(const SurfacePoint& at, Vec3 direction)
    : surface(at), to_viewer(-direction), entering(dot(to_double(direction), at.geometric_normal) < 0) {
  flat_normal = to_float(entering ? at.geometric_normal : -at.geometric_normal);
  const Vec3 smooth = to_float(entering ? at.shading_normal : -at.shading_normal);
  // An interpolated normal may point away from a viewer that sees the surface; the flat one never does.
  normal = dot(direction, smooth) < 0 ? smooth : flat_normal;
}

Vec3 mirrored(const Shading& at) {
  const Vec3 smooth = mirror(-at.to_viewer, at.normal);
  return dot(smooth, at.flat_normal) > 0 ? smooth : mirror(-at.to_viewer, at.flat_normal);
}

std::optional<Vec3> refracted(const Shading& at, float eta) {
  const auto smooth = refract(-at.to_viewer, at.normal, eta);
  return !smooth || dot(*smooth, at.flat_normal) < 0 ? smooth : refract(-at.to_viewer, at.flat_normal, eta);
}

}  // namespace tessera

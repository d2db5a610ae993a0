#include "core/integrator/shading.h"

#include "core/material/shade.h"

namespace tessera {
namespace {

/// An interpolated normal may point away from a viewer who sees the surface. It is turned then until it all but faces
/// him: so shading changes as steadily there as elsewhere, while the flat normal would stand out.
Vec3 turned_towards(Vec3 viewer, Vec3 smooth, Vec3 flat) {
  constexpr float kAllBut = 1e-3F;
  if (smooth == flat) return flat;
  const float along = dot(smooth, viewer);
  if (along > 0) return smooth;
  const auto turned = UnitVec3::normalize(smooth - viewer * along);
  if (!turned) return flat;
  return UnitVec3::normalize(Vec3(*turned) + viewer * kAllBut).value_or(*turned);
}

}  // namespace

Shading::Shading(const SurfacePoint& at, Vec3 direction)
    : surface(at), to_viewer(-direction), entering(dot(to_double(direction), at.geometric_normal) < 0) {
  flat_normal = to_float(entering ? at.geometric_normal : -at.geometric_normal);
  const Vec3 smooth = to_float(entering ? at.shading_normal : -at.shading_normal);
  normal = turned_towards(to_viewer, smooth, flat_normal);
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

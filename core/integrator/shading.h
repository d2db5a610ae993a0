#pragma once

#include <optional>

#include "core/geometry/surface_point.h"
#include "core/math/vec.h"

namespace tessera {

/// A hit as shading sees it: normals turned towards the viewer.
struct Shading {
  /// `direction` is that of the ray that hit, of length 1.
  Shading(const SurfacePoint& at, Vec3 direction);

  SurfacePoint surface;
  Vec3 flat_normal;
  Vec3 normal;
  Vec3 to_viewer;
  bool entering;  ///< The ray came from outside.
};

/// Mirrored at the shading normal, or at the flat one where that would lead into the surface.
Vec3 mirrored(const Shading& at);

/// Bent at the shading normal, or at the flat one where that would lead back out; nothing at total internal reflection.
/// `eta` as in `refract`.
std::optional<Vec3> refracted(const Shading& at, float eta);

}  // namespace tessera

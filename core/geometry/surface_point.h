#pragma once

#include "core/math/vec.h"

namespace tessera {

/// Where a ray met a primitive, and how well that is known.
struct SurfacePoint {
  Vec3d position;          ///< On the primitive to `error`, per axis (not merely on the ray).
  Vec3d error;             ///< ≥ 0; bounds |position − exact surface| per axis.
  Vec3d geometric_normal;  ///< Unit; outward of solids, counter-clockwise face of flat shapes.
  Vec3d shading_normal;    ///< Unit, on the geometric normal's side; another only on meshes with vertex normals.
  /// From `position` to the smooth surface that vertex normals stand for, where that lies farther out on the side the
  /// ray came from: never into the surface. Zero without vertex normals.
  Vec3d to_smooth{};
  /// What a triangle's second and third corner count for in a mix; the first one has what is left of 1.
  double second_share = 0, third_share = 0;
};

}  // namespace tessera

#pragma once

#include <span>

#include "core/accel/accel.h"
#include "core/geometry/surface_point.h"
#include "core/math/ray.h"
#include "core/scene/scene.h"

namespace tessera {

/// The point of the world where a hit lies, its error bounded there, and its normals on the outer side.
SurfacePoint world_surface(const Scene& scene, std::uint32_t object, std::uint32_t primitive, const Ray& ray, float t);

/// A float origin beside the surface, on the side that `toward` points to, so far off that a ray from it never meets
/// the surface it left: the point is moved along the normal by twice its error bound, then each coordinate is
/// rounded away from the surface (after Pharr, Jakob & Humphreys, PBRT 4th ed., 6.8.6). It may be `away` from the
/// surface, on that side, before.
Vec3 spawn_origin(const SurfacePoint& from, Vec3d toward, Vec3d away = {});

/// A ray to another start of rays ends a little beyond it: both are rounded, and nothing may slip through in between.
inline constexpr float kJustBeyond = 1 + 0x1p-10F;

/// What a ray leaves that starts at `spawn_origin` on the side of `normal` (unit), for `Ray::leaves`.
PrimitiveId left_by(Vec3 direction, Vec3 normal, PrimitiveId surface);

/// What rays meet that have passed surfaces as if these weren't there: behind `passed` in the order of hits, where
/// `t_min` is its t. So none is met twice, and of layers that lie on each other, to the last bit or nearly, each is
/// met; but those of one object are one layer, as `Accel::coincident` has it. A ray whose `passed` lies at infinity has
/// met nothing yet.
void find_behind(const Accel& accel, std::span<const Ray> rays, std::span<const Hit> passed, std::span<Hit> hits,
                 TraceLog log);

}  // namespace tessera

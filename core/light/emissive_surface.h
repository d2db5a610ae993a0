#pragma once

#include <array>
#include <optional>

#include "core/light/light_bounds.h"
#include "core/math/ray.h"
#include "core/math/vec2.h"
#include "core/scene/scene.h"

namespace tessera {

// Primitives as lights: triangles, quads, spheres and disks, placed or not. Points are chosen evenly over the area, but
// evenly over the solid angle on triangles and quads that fill much of it (`SphericalTriangle`), and on a sphere: seen
// from outside, over the cone that it fills; from inside, over all directions. What a placement makes an ellipsoid is
// chosen from by area, like the flat ones. All in double, in the world.

/// Cylinders and cones aren't, nor quads whose halves lie one upon the other, as those of a dart may: they are lights
/// only for rays that meet them by chance.
bool can_be_sampled(const Shape& shape);

struct SurfaceSample {
  Vec3d way;   ///< From the point asked for to one on the surface; of any length but 0.
  bool front;  ///< That point shows its outer side.
  double pdf;  ///< Per solid angle; > 0 and finite.
};

/// A point of the primitive as seen from `from`, for `u` in [0, 1)²; nothing when it isn't one that can be seen from
/// there. Precondition: `can_be_sampled`.
std::optional<SurfaceSample> sample_surface(const Scene& scene, PrimitiveId primitive, Vec3d from, Vec2 u);

/// The corners of a mesh's triangle in the world, counter-clockwise from its outer side: as floats, which is what they
/// are without a placement.
using WorldTriangle = std::array<Vec3, 3>;
WorldTriangle world_triangle(const Object& object, const TriangleMesh& mesh, std::uint32_t primitive);

/// The same as of the primitive.
std::optional<SurfaceSample> sample_surface(const WorldTriangle& triangle, Vec3d from, Vec2 u);
double surface_pdf(const WorldTriangle& triangle, Vec3d from, Vec3 direction, double distance);

/// Where `ray`, whose point at t = 1 lies on the triangle but for rounding, comes so near it that a structure may find
/// it there, `error` (metres) being how far off the structure may see it; nothing where that isn't known well, or far
/// from 1.
std::optional<float> t_before(const WorldTriangle& triangle, const Ray& ray, double error);

/// The density with which `sample_surface` chooses the direction (unit) from `from` in which the primitive lies at
/// `distance`, where its geometric normal is `normal`; finite. 0 for what it never chooses: the far side of a sphere
/// seen from outside.
double surface_pdf(const Scene& scene, PrimitiveId primitive, Vec3d from, Vec3 direction, double distance,
                   Vec3d normal);

/// How it shines when it sends out this radiance (W/(sr m²)); intensity 0 when it has no area.
LightBounds surface_bounds(const Scene& scene, PrimitiveId primitive, double radiance, bool both_sides);

/// Where `ray`, whose point at t = 1 lies on the primitive but for rounding, meets it near there: the very t that a
/// structure finds. Nothing when it misses.
std::optional<float> t_near_one(const Scene& scene, PrimitiveId primitive, const Ray& ray);

}  // namespace tessera

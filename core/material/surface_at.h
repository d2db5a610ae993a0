#pragma once

#include "core/geometry/surface_point.h"
#include "core/math/ray.h"
#include "core/scene/scene.h"

namespace tessera {

/// A material at one point.
struct SurfaceAt {
  Surface surface;
  Rgb emission;
};

/// What a material that `varies` is at a point of one of the object's triangles, whose shading normal is turned as its
/// normal or bump map says. Without the attributes that a texture asks for it is looked up at (0, 0); of shapes that
/// aren't meshes the material's own numbers are told.
SurfaceAt surface_at(const Scene& scene, const Object& object, std::uint32_t primitive, SurfacePoint& point);

/// What the object's triangle sends out by itself where its second and third corner count for so much.
Rgb emission_at(const Scene& scene, const Object& object, std::uint32_t primitive, double second_share,
                double third_share);

/// What the object's primitive sends out on the whole, about: the mean over all channels and the texels around it. 0
/// only where it sends out nothing.
double mean_emission(const Scene& scene, const Object& object, std::uint32_t primitive);

/// The share of light that meets the object's primitive where `ray` hits it, in 0..1.
float alpha_at(const Scene& scene, const Object& object, std::uint32_t primitive, const Ray& ray);

}  // namespace tessera

#pragma once

#include <optional>

#include "core/math/rgb.h"
#include "core/math/unit_vec3.h"
#include "core/scene/material.h"

namespace tessera {

/// What a light of `irradiance` (on a plane that faces it) adds at a surface: `WhittedSurface`'s formula. All
/// directions unit and away from the surface; 0 when the light is below the horizon.
Rgb shade(const WhittedSurface& surface, Vec3 normal, Vec3 to_viewer, Vec3 to_light, Rgb irradiance);

/// `direction` mirrored at the plane of `normal`; of the same length.
Vec3 mirror(Vec3 direction, Vec3 normal);

/// `direction` (unit) bent by Snell's law on passing to a medium whose index is `eta` times denser; `normal` is unit
/// and on the side it comes from. Nothing at total internal reflection.
std::optional<Vec3> refract(Vec3 direction, Vec3 normal, float eta);

/// The share of unpolarised light that a dielectric reflects; 1 at total internal reflection. Arguments as above.
float fresnel(Vec3 direction, Vec3 normal, float eta);

}  // namespace tessera

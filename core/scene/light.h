#pragma once

#include <variant>

#include "core/math/rgb.h"
#include "core/math/unit_vec3.h"

namespace tessera {

/// Radiates evenly from a point. Its irradiance at distance d is intensity / d², or plain intensity when it
/// doesn't fall off (NFF's lights).
struct PointLight {
  Vec3 position;
  Rgb intensity;  ///< W/sr; W/m² when `falls_off` is false.
  bool falls_off = true;
};

/// Parallel light from infinitely far away.
struct DirectionalLight {
  UnitVec3 direction = -UnitVec3::z();  ///< The way the light travels.
  Rgb irradiance;                       ///< W/m² on a plane that faces it.
};

/// Light from everywhere, shadowless: adds diffuse · radiance at every hit.
struct AmbientLight {
  Rgb radiance;
};

using Light = std::variant<PointLight, DirectionalLight, AmbientLight>;

}  // namespace tessera

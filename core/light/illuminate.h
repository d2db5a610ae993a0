#pragma once

#include "core/math/ray.h"
#include "core/math/rgb.h"
#include "core/scene/light.h"

namespace tessera {

/// What a light sends to a point if nothing stands in between.
struct Illumination {
  Vec3 to_light;   ///< Unit.
  Rgb irradiance;  ///< On a plane that faces the light.
  Ray shadow_ray;  ///< Occluded exactly when something stands in between.
};

/// Black, with a shadow ray that hits nothing, when `point` is the light's own position.
Illumination illuminate(const PointLight& light, Vec3 point);
Illumination illuminate(const DirectionalLight& light, Vec3 point);

}  // namespace tessera

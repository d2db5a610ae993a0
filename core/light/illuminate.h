#pragma once

#include "core/math/ray.h"
#include "core/math/rgb.h"
#include "core/math/rounding.h"
#include "core/scene/light.h"

namespace tessera {

/// A shadow ray's end and its light's surface are both off by a few roundings of the whole way, so it stops 16 of them
/// short: a lamp is not in its own shadow.
inline constexpr float kJustBeforeLight = 1 - 16 * static_cast<float>(kUnitRoundoff);

/// What a light sends to a point if nothing stands in between.
struct Illumination {
  Vec3 to_light;   ///< Unit.
  Rgb irradiance;  ///< On a plane that faces the light.
};

/// Black when `point` is the light's own position.
Illumination illuminate(const PointLight& light, Vec3 point);
Illumination illuminate(const DirectionalLight& light, Vec3 point);

/// Occluded exactly when something stands between a point and the light; hits nothing when that is the light's own
/// position.
Ray shadow_ray(const PointLight& light, Vec3 from);
Ray shadow_ray(const DirectionalLight& light, Vec3 from);

}  // namespace tessera

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "core/math/rgb.h"
#include "core/math/unit_vec3.h"

namespace tessera {

/// Intensities, irradiances, radiances and texels are at most this in each channel: so no product of two, nor a sun's
/// radiance, overflows a float.
inline constexpr float kLargestLight = 1e18F;

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

/// Radiates from a point into a cone. Within `inner_angle` of its axis it is a point light; from there on it fades to
/// nothing at `outer_angle`, smoothly in the cosine of the angle (smoothstep, as PBRT does).
struct SpotLight {
  Vec3 position;
  UnitVec3 direction = -UnitVec3::z();
  Rgb intensity;          ///< W/sr, on the axis.
  float inner_angle = 0;  ///< Radians from the axis; 0 ≤ inner ≤ outer ≤ π/2, outer > 0.
  float outer_angle = 0.7853982F;
};

/// A disk in the sky, infinitely far away and of the same radiance all over: a directional light with soft shadows.
struct SunLight {
  UnitVec3 direction = -UnitVec3::z();  ///< The way the light of its centre travels.
  Rgb irradiance;                       ///< W/m² on a plane that faces it.
  float angle = 0.00925F;               ///< Its angular diameter in radians; in (0, π].
};

/// A picture of all directions, equirectangular: the first row's upper edge is +y, the last one's lower edge −y, the
/// middle of the picture −z, and a quarter of its width right of that is +x.
struct EnvironmentMap {
  std::uint32_t width = 0, height = 0;
  std::vector<Rgb> texels;  ///< Row by row; finite and ≥ 0.
};

/// Light from all around, infinitely far away: what a ray sees that hits nothing.
struct EnvironmentLight {
  Rgb radiance{1, 1, 1};                                     ///< W/(sr m²); scales the map, where there is one.
  std::shared_ptr<const EnvironmentMap> map;                 ///< Null for a constant.
  std::array<float, 9> to_world{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< A rotation, row by row, of the map's directions.
};

/// Whether no light comes from it: its radiance or all of its map is black.
bool is_black(const EnvironmentLight& light);

using Light = std::variant<PointLight, DirectionalLight, AmbientLight, SpotLight, SunLight, EnvironmentLight>;

}  // namespace tessera

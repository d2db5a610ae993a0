#include "core/material/shade.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/material/fresnel.h"
#include "core/math/portable.h"

namespace tessera {

Rgb shade(const WhittedSurface& surface, Vec3 normal, Vec3 to_viewer, Vec3 to_light, Rgb irradiance) {
  const float cos_theta = dot(normal, to_light);
  if (!(cos_theta > 0)) return {};
  Rgb scattered = surface.diffuse * cos_theta;
  if (!surface.specular.is_black()) {
    const float cos_alpha = std::min(dot(mirror(-to_viewer, normal), to_light), 1.0F);  // above 1 by rounding alone
    if (cos_alpha > 0) scattered = scattered + surface.specular * portable_pow(cos_alpha, surface.shininess);
  }
  return scattered * irradiance * std::numbers::inv_pi_v<float>;
}

Vec3 mirror(Vec3 direction, Vec3 normal) { return direction - normal * (2 * dot(direction, normal)); }

std::optional<Vec3> refract(Vec3 direction, Vec3 normal, float eta) {
  const float cos_in = -dot(direction, normal);
  const float ratio = 1 / eta;
  const float cos2_out = 1 - ratio * ratio * (1 - cos_in * cos_in);
  if (!(cos2_out > 0)) return std::nullopt;
  return direction * ratio + normal * (ratio * cos_in - std::sqrt(cos2_out));
}

float fresnel(Vec3 direction, Vec3 normal, float eta) {
  const float cos_in = std::min(std::abs(dot(direction, normal)), 1.0F);
  return dielectric_fresnel(cos_in, 1 - cos_in * cos_in, eta);
}

}  // namespace tessera

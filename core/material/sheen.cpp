#include "core/material/sheen.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "core/material/ggx.h"
#include "core/material/sheen_table.h"
#include "core/math/portable.h"

namespace tessera {
namespace {

/// Closer to the horizon the fit grows without bounds.
constexpr float kLeastCosine = 1e-4F;

float effective(float roughness) { return std::clamp(roughness, kLeastSheenRoughness, 1.0F); }

float bounded(float cos_theta) { return std::clamp(cos_theta, kLeastCosine, 1.0F); }

/// Λ(θ), which the paper fits by exp of a curve below 60 degrees from the horizon, and mirrors above them.
float hidden(float cos_theta, float alpha) {
  const float t = (1 - alpha) * (1 - alpha);
  const auto between = [&](float rough, float smooth) { return rough + (smooth - rough) * t; };
  const float a = between(21.5473F, 25.3245F), b = between(3.82987F, 3.32435F), c = between(0.19823F, 0.16801F);
  const float d = between(-1.97760F, -1.27393F), e = between(-4.32054F, -4.85967F);
  const auto curve = [&](float x) { return a / (1 + b * portable_pow(x, c)) + d * x + e; };
  const float exponent = cos_theta < 0.5F ? curve(cos_theta) : 2 * curve(0.5F) - curve(1 - cos_theta);
  return static_cast<float>(portable_exp2(exponent * std::numbers::log2e));
}

/// The fit's own, which may be above 1.
float fitted_albedo(float cos_theta, float roughness) {
  const auto place = [](float share, std::size_t size, std::size_t& first) {
    const float at = std::clamp(share, 0.0F, 1.0F) * static_cast<float>(size - 1);
    first = std::min(static_cast<std::size_t>(at), size - 2);
    return at - static_cast<float>(first);
  };
  std::size_t i = 0, j = 0;
  const float down = place(sheen_table_roughness(effective(roughness)), kSheenRoughnesses, i);
  const float right = place(sheen_table_cosine(bounded(cos_theta)), kSheenCosines, j);
  const auto along = [&](std::size_t row) {
    const float a = kSheenAlbedo[row][j], b = kSheenAlbedo[row][j + 1];
    return a + (b - a) * right;
  };
  const float first = along(i), second = along(i + 1);
  return (first + (second - first) * down) / kSheenTableOne;
}

}  // namespace

Sheen::Sheen(Vec3 wo, float roughness)
    : alpha_(ggx_alpha(effective(roughness))),
      hidden_(hidden(bounded(wo.z), alpha_)),
      scale_(1 / std::max(fitted_albedo(wo.z, roughness), 1.0F)) {}

float Sheen::evaluate(Vec3 wo, Vec3 wi) const {
  const Vec3 h = half_vector(wo, wi);
  const float sin2 = std::min(h.x * h.x + h.y * h.y, 1.0F);
  const float density = (2 + 1 / alpha_) * portable_pow(sin2, 0.5F / alpha_) * (std::numbers::inv_pi_v<float> / 2);
  const float cos_i = bounded(wi.z);
  const float visible = 1 / ((1 + hidden_ + hidden(cos_i, alpha_)) * (4 * bounded(wo.z) * cos_i));
  return density * visible * wi.z * scale_;
}

float sheen_albedo(float cos_theta, float roughness) { return std::min(fitted_albedo(cos_theta, roughness), 1.0F); }

}  // namespace tessera

#include "core/material/conductor_bsdf.h"

#include <algorithm>

#include "core/material/fresnel.h"
#include "core/material/ggx.h"
#include "core/material/ggx_albedo.h"

namespace tessera {
namespace {

/// More than any substance has; what is computed of it stays finite.
constexpr float kLargestIndex = 1e4F;

Rgb bounded(Rgb index) {
  return {std::clamp(index.r, 0.0F, kLargestIndex), std::clamp(index.g, 0.0F, kLargestIndex),
          std::clamp(index.b, 0.0F, kLargestIndex)};
}

/// 1 + F_avg (1 - E) / E
Rgb compensation(const ConductorBsdf& bsdf, Vec3 wo) {
  return Rgb{1, 1, 1} + bsdf.average_fresnel * (1 / ggx_albedo(wo.z, bsdf.roughness).white - 1);
}

}  // namespace

ConductorBsdf bsdf_of(const Conductor& surface, bool) {
  ConductorBsdf bsdf{bounded(surface.eta), bounded(surface.k), effective_roughness(surface.roughness)};
  if (bsdf.roughness > 0)
    bsdf.average_fresnel = hemisphere_mean([&](float c) { return conductor_fresnel(c, bsdf.eta, bsdf.k); });
  return bsdf;
}

BsdfValue ConductorBsdf::evaluate(Vec3 wo, Vec3 wi) const {
  if (!(roughness > 0 && wo.z > 0 && wi.z > 0)) return {};
  const Ggx ggx{ggx_alpha(roughness)};
  const Vec3 h = half_vector(wo, wi);
  const float density = ggx.density(h) / 4;
  const Rgb fresnel = conductor_fresnel(cosine(wo, h), eta, k);
  return {fresnel * compensation(*this, wo) * (density * ggx.masked(wo, wi)), density * ggx.visible(wo)};
}

std::optional<BsdfSample> ConductorBsdf::sample(Vec3 wo, float, Vec2 u) const {
  if (!(wo.z > 0)) return std::nullopt;
  if (roughness == 0) {
    const Rgb fresnel = conductor_fresnel(std::min(wo.z, 1.0F), eta, k);
    return BsdfSample{.wi = {-wo.x, -wo.y, wo.z}, .weight = fresnel, .pdf = 1, .is_delta = true};
  }
  const Ggx ggx{ggx_alpha(roughness)};
  const Vec3 h = ggx.sample_visible(wo, u);
  const float cos_h = cosine(wo, h);
  const Vec3 wi = h * (2 * cos_h) - wo;
  if (!(wi.z > 0)) return std::nullopt;
  const float visible = ggx.visible(wo);
  const Rgb fresnel = conductor_fresnel(cos_h, eta, k);
  return BsdfSample{.wi = wi,
                    .weight = fresnel * compensation(*this, wo) * (ggx.masked(wo, wi) / visible),
                    .pdf = ggx.density(h) * visible / 4};
}

Rgb ConductorBsdf::albedo(Vec3 wo) const {
  const Vec3 up{wo.x, wo.y, std::clamp(wo.z, 0.0F, 1.0F)};
  const Rgb fresnel = conductor_fresnel(up.z, eta, k);
  return roughness > 0 ? fresnel * compensation(*this, up) * ggx_albedo(up.z, roughness).white : fresnel;
}

}  // namespace tessera

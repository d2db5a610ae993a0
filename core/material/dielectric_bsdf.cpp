#include "core/material/dielectric_bsdf.h"

#include <algorithm>
#include <cmath>

#include "core/material/fresnel.h"
#include "core/material/ggx.h"
#include "core/material/ggx_albedo.h"

namespace tessera {
namespace {

/// Light that passes a rough surface is bent into a lobe about alpha · |eta - 1| wide. Where that is as narrow as the
/// lobes of what `kLeastRoughness` makes smooth, this is smooth as well.
constexpr float kLeastSpread = kLeastRoughness * kLeastRoughness;

/// How light meets a facet.
struct Meeting {
  float cos;         ///< With the facet's normal.
  Vec3 along;        ///< The part of wo in the facet's plane, from which small angles come without cancellation.
  float sin2;        ///< Its length squared.
  float fresnel;     ///< The reflected share of the light,
  float reflection;  ///< and of what is drawn: the same unless colour takes from what passes.
};

Meeting meet(const DielectricBsdf& bsdf, Vec3 wo, Vec3 h) {
  Meeting at{};
  at.cos = std::min(dot(wo, h), 1.0F);
  at.along = wo - h * at.cos;
  at.sin2 = dot(at.along, at.along);
  at.fresnel = bsdf.eta == 1 ? 0 : dielectric_fresnel(at.cos, at.sin2, bsdf.eta);
  const float passed = (1 - at.fresnel) * std::max({bsdf.color.r, bsdf.color.g, bsdf.color.b});
  at.reflection = at.fresnel > 0 ? at.fresnel / (at.fresnel + passed) : 0;
  return at;
}

float square(float x) { return x * x; }

}  // namespace

DielectricBsdf bsdf_of(const Dielectric& surface, bool entering) {
  const float eta = entering ? surface.ior : 1 / surface.ior;
  const float roughness = effective_roughness(surface.roughness);
  const bool spreads = ggx_alpha(roughness) * std::abs(eta - 1) >= kLeastSpread;
  return {eta, spreads ? roughness : 0, surface.color};
}

BsdfValue DielectricBsdf::evaluate(Vec3 wo, Vec3 wi) const {
  if (!(roughness > 0 && wo.z > 0) || wi.z == 0) return {};
  const bool reflects = wi.z > 0;
  // Along the normal of the facet that leads from one direction to the other.
  const Vec3 sum = reflects ? wo + wi : wo + wi * eta;
  const float sum2 = dot(sum, sum);
  if (!(sum2 > 0)) return {};
  const Vec3 h = sum / std::copysign(std::sqrt(sum2), sum.z);
  const float cos_i = dot(wi, h);
  const Meeting at = meet(*this, wo, h);
  if (!(at.cos > 0 && (reflects || cos_i < 0))) return {};  // The facet is seen from behind.

  const Ggx ggx{ggx_alpha(roughness)};
  const float density = ggx.density(h);
  const float seen = ggx.visible(wo), scale = ggx.masked(wo, wi) / dielectric_albedo(wo.z, roughness, eta);
  if (reflects) {
    const float f_cos = density / 4 * at.fresnel * scale;
    return {{f_cos, f_cos, f_cos}, density / 4 * at.reflection * seen};
  }
  // The solid angle of micronormals by that of wi is eta² times this, and the scaling of radiance takes the eta² again.
  const float spread = -cos_i / sum2;
  return {color * ((1 - at.fresnel) * density * at.cos * spread * scale),
          (1 - at.reflection) * density * at.cos * spread * square(eta) * seen};
}

std::optional<BsdfSample> DielectricBsdf::sample(Vec3 wo, float u_lobe, Vec2 u) const {
  if (!(wo.z > 0)) return std::nullopt;
  const bool is_delta = roughness == 0;
  const Ggx ggx{ggx_alpha(roughness)};
  const Vec3 h = is_delta ? Vec3{0, 0, 1} : ggx.sample_visible(wo, u);
  const Meeting at = meet(*this, wo, h);
  if (!(at.cos > 0)) return std::nullopt;

  BsdfSample chosen{.is_delta = is_delta, .transmits = !(u_lobe < at.reflection)};
  if (chosen.transmits) {
    const float cos_out = std::sqrt(std::max(1 - at.sin2 / square(eta), 0.0F));
    chosen.wi = eta == 1 ? -wo : -(at.along / eta + h * cos_out);
    chosen.eta_scale = square(eta);
    chosen.pdf = 1 - at.reflection;
    chosen.weight = color * ((1 - at.fresnel) / chosen.pdf / chosen.eta_scale);
    if (!(chosen.wi.z < 0)) return std::nullopt;
    if (!is_delta) chosen.pdf *= ggx.density(h) * at.cos * cos_out / square(cos_out - at.cos / eta) * ggx.visible(wo);
  } else {
    chosen.wi = h * (2 * at.cos) - wo;
    chosen.pdf = at.reflection;
    const float weight = at.fresnel / at.reflection;
    chosen.weight = {weight, weight, weight};
    if (!(chosen.wi.z > 0)) return std::nullopt;
    if (!is_delta) chosen.pdf *= ggx.density(h) / 4 * ggx.visible(wo);
  }
  if (!is_delta) {
    const float kept = ggx.masked(wo, chosen.wi) / ggx.visible(wo);
    chosen.weight = chosen.weight * (kept / dielectric_albedo(wo.z, roughness, eta));
  }
  return chosen;
}

Rgb DielectricBsdf::albedo(Vec3 wo) const {
  const float fresnel = meet(*this, wo, {0, 0, 1}).fresnel;
  return Rgb{fresnel, fresnel, fresnel} + color * (1 - fresnel);
}

}  // namespace tessera

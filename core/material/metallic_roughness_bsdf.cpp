#include "core/material/metallic_roughness_bsdf.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/material/fresnel.h"
#include "core/material/ggx.h"
#include "core/material/highlight.h"
#include "core/sampling/warp.h"

namespace tessera {
namespace {

constexpr float kDielectricF0 = 0.04F;

/// What the metal and the coat reflect together.
Rgb reflected(const MetallicRoughnessBsdf& bsdf, float schlick_term, float lost) {
  const float coat = (1 - bsdf.metallic) * facets_reflect(kDielectricF0, schlick_term, lost);
  const auto both = [&](float base) { return coat + bsdf.metallic * facets_reflect(base, schlick_term, lost); };
  return {both(bsdf.base_color.r), both(bsdf.base_color.g), both(bsdf.base_color.b)};
}

/// What the coat doesn't reflect.
float passed(const Highlight& highlight) { return highlight.passed(kDielectricF0); }

/// E_avg's complement by roughness, from the least to 1: what is the same for all materials isn't integrated at each
/// hit.
const auto kBaseMeans = [] {
  std::array<float, 33> means{};
  for (std::size_t i = 0; i < means.size(); ++i) {
    const float share = static_cast<float>(i) / static_cast<float>(means.size() - 1);
    const float roughness = kLeastRoughness + (1 - kLeastRoughness) * share;
    means[i] = hemisphere_mean([&](float c) { return passed(Highlight(c, std::min(roughness, 1.0F))); });
  }
  return means;
}();

float base_mean(float roughness) {
  if (roughness == 0) return hemisphere_mean([](float c) { return passed(Highlight(c, 0)); });
  const float at = (roughness - kLeastRoughness) / (1 - kLeastRoughness) * static_cast<float>(kBaseMeans.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), kBaseMeans.size() - 2);
  return kBaseMeans[i] + (kBaseMeans[i + 1] - kBaseMeans[i]) * (at - static_cast<float>(i));
}

/// What is the same for all wi.
struct View {
  Highlight highlight;
  Rgb base, specular;    ///< The albedos of both lobes.
  float specular_share;  ///< The probability of drawing the highlight.

  View(const MetallicRoughnessBsdf& bsdf, Vec3 wo)
      : highlight(std::min(wo.z, 1.0F), bsdf.roughness),
        base(bsdf.base_color * ((1 - bsdf.metallic) * passed(highlight))),
        specular(reflected(bsdf, highlight.single.schlick_mean, highlight.lost) * highlight.single.white),
        specular_share(base.is_black() ? 1 : largest(specular) / (largest(specular) + largest(base))) {}
};

BsdfValue evaluate_from(const View& view, const MetallicRoughnessBsdf& bsdf, Vec3 wo, Vec3 wi) {
  BsdfValue value;
  if (bsdf.metallic < 1) {
    const float pdf = cosine_hemisphere_pdf(wi.z);
    value.f_cos = view.base * (passed(Highlight(std::min(wi.z, 1.0F), bsdf.roughness)) / bsdf.base_mean * pdf);
    value.pdf = (1 - view.specular_share) * pdf;
  }
  if (bsdf.roughness > 0) {
    const Ggx ggx{ggx_alpha(bsdf.roughness)};
    const Vec3 h = half_vector(wo, wi);
    const float density = ggx.density(h) / 4;
    value.f_cos =
        value.f_cos + reflected(bsdf, schlick(cosine(wo, h)), view.highlight.lost) * (density * ggx.masked(wo, wi));
    value.pdf += view.specular_share * density * ggx.visible(wo);
  }
  return value;
}

}  // namespace

MetallicRoughnessBsdf bsdf_of(const MetallicRoughness& surface, bool) {
  const float roughness = effective_roughness(surface.roughness);
  return {.base_color = surface.base_color,
          .metallic = surface.metallic,
          .roughness = roughness,
          .base_mean = base_mean(roughness)};
}

BsdfValue MetallicRoughnessBsdf::evaluate(Vec3 wo, Vec3 wi) const {
  if (!(wo.z > 0 && wi.z > 0)) return {};
  return evaluate_from(View(*this, wo), *this, wo, wi);
}

std::optional<BsdfSample> MetallicRoughnessBsdf::sample(Vec3 wo, float u_lobe, Vec2 u) const {
  if (!(wo.z > 0)) return std::nullopt;
  const View view(*this, wo);
  const bool is_highlight = u_lobe < view.specular_share;
  if (is_highlight && roughness == 0)
    return BsdfSample{.wi = {-wo.x, -wo.y, wo.z},
                      .weight = view.specular * (1 / view.specular_share),
                      .pdf = view.specular_share,
                      .is_delta = true};
  Vec3 wi;
  if (is_highlight) {
    const Vec3 h = Ggx{ggx_alpha(roughness)}.sample_visible(wo, u);
    wi = h * (2 * cosine(wo, h)) - wo;
  } else {
    wi = cosine_hemisphere(u);
  }
  if (!(wi.z > 0)) return std::nullopt;
  const BsdfValue value = evaluate_from(view, *this, wo, wi);
  if (!(value.pdf > 0)) return std::nullopt;
  return BsdfSample{.wi = wi, .weight = value.f_cos * (1 / value.pdf), .pdf = value.pdf};
}

Rgb MetallicRoughnessBsdf::albedo(Vec3 wo) const {
  if (!(wo.z > 0)) return base_color;
  const View view(*this, wo);
  return view.base + view.specular;
}

}  // namespace tessera

#include "core/material/layered_bsdf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/material/fresnel.h"
#include "core/material/ggx.h"
#include "core/material/ggx_albedo.h"
#include "core/material/highlight.h"
#include "core/material/sheen.h"
#include "core/sampling/warp.h"

namespace tessera {
namespace {

constexpr float kCoatF0 = 0.04F;
constexpr float kLargestIor = 1e3F;  ///< What an infinite one counts as where light is to pass.

/// What the dielectric's highlight reflects of even light is a polynomial of f0: square · f0² + linear · f0 + constant,
/// of which the coefficients sum to 1 and depend on the roughness alone.
struct HighlightMean {
  float square, constant;

  explicit HighlightMean(float roughness) {
    const auto of_light = [&](const auto& f) {
      return hemisphere_mean([&](float c) { return f(Highlight(c, roughness).single); });
    };
    square = of_light([](GgxAlbedo a) { return (1 - a.schlick_mean) * (1 - a.white); });
    constant = of_light([](GgxAlbedo a) { return a.schlick_mean * a.white; });
  }
  HighlightMean() : square(), constant() {}

  float reflected(float f0) const { return (square * f0 + (1 - square - constant)) * f0 + constant; }
};

/// By roughness, from the least to 1, as the means of metallic_roughness_bsdf.cpp.
const auto kHighlightMeans = [] {
  std::array<HighlightMean, 33> means{};
  for (std::size_t i = 0; i < means.size(); ++i) {
    const float share = static_cast<float>(i) / static_cast<float>(means.size() - 1);
    means[i] = HighlightMean(std::min(kLeastRoughness + (1 - kLeastRoughness) * share, 1.0F));
  }
  return means;
}();

float mean_reflected(float f0, float roughness) {
  if (roughness == 0) return HighlightMean(0).reflected(f0);
  const float at =
      (roughness - kLeastRoughness) / (1 - kLeastRoughness) * static_cast<float>(kHighlightMeans.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), kHighlightMeans.size() - 2);
  const float first = kHighlightMeans[i].reflected(f0), second = kHighlightMeans[i + 1].reflected(f0);
  return first + (second - first) * (at - static_cast<float>(i));
}

Rgb at_most_one(Rgb c) { return {std::min(c.r, 1.0F), std::min(c.g, 1.0F), std::min(c.b, 1.0F)}; }

/// What the metal and the dielectric above what is diffuse or a sheet reflect, together.
Rgb reflected(const LayeredBsdf& bsdf, float schlick_term, float lost) {
  const float share = bsdf.coated * bsdf.specular;
  const auto both = [&](float f0, float base) {
    return share * facets_reflect(f0, schlick_term, lost) + bsdf.metal * facets_reflect(base, schlick_term, lost);
  };
  return {both(bsdf.f0.r, bsdf.base_color.r), both(bsdf.f0.g, bsdf.base_color.g), both(bsdf.f0.b, bsdf.base_color.b)};
}

/// What the dielectric doesn't reflect, of the channel that it reflects most of.
float passed(const LayeredBsdf& bsdf, const Highlight& highlight) {
  return std::max(1 - bsdf.specular * (1 - highlight.passed(largest(bsdf.f0))), 0.0F);
}

bool has_sheen(const LayeredBsdf& bsdf) { return !bsdf.sheen_color.is_black(); }

/// What the sheen lets pass.
float beneath_sheen(const LayeredBsdf& bsdf, float cos_theta) {
  return has_sheen(bsdf) ? 1 - largest(bsdf.sheen_color) * sheen_albedo(cos_theta, bsdf.sheen_roughness) : 1;
}

/// How `specular` and its colour change what glass reflects and lets pass: as much as KHR_materials_specular has them
/// change Schlick's term, with Fresnel's in its place. Total reflection remains.
struct GlassTint {
  Rgb reflected{1, 1, 1};
  float passed = 1;

  GlassTint(const LayeredBsdf& bsdf, Vec3 wo, Vec3 wi) {
    if (!bsdf.tints_glass) return;
    const float eta = bsdf.glass_bsdf.eta;
    const Vec3 sum = wi.z > 0 ? wo + wi : wo + wi * eta;
    const float size = length(sum);
    if (!(size > 0)) return;
    const float cos_h = std::min(std::abs(dot(wo, sum)) / size, 1.0F);
    const float fresnel = eta == 1 ? 0 : dielectric_fresnel(cos_h, 1 - cos_h * cos_h, eta);
    if (!(fresnel > 0 && fresnel < 1)) return;
    const float usual_f0 = (eta - 1) / (eta + 1) * ((eta - 1) / (eta + 1));
    const float towards_one = std::clamp((fresnel - usual_f0) / (1 - usual_f0), 0.0F, 1.0F);
    const auto changed = [&](float f0) { return bsdf.specular * (f0 + (1 - f0) * towards_one); };
    const Rgb now{changed(bsdf.f0.r), changed(bsdf.f0.g), changed(bsdf.f0.b)};
    reflected = now * (1 / fresnel);
    passed = (1 - largest(now)) / (1 - fresnel);
  }
};

/// The glass from one direction.
struct GlassView {
  Rgb albedo{};
  /// `DielectricBsdf`'s scale gives back what scatters often of light that is reflected as it reflects. Facets keep
  /// less of what passes: so where `specular` has more pass, less is given back, lest more came than is.
  float scale = 1;

  GlassView() = default;
  GlassView(const LayeredBsdf& bsdf, Vec3 wo) : albedo(bsdf.glass_bsdf.albedo(wo)) {
    if (!bsdf.tints_glass) return;
    const GlassTint tint(bsdf, wo, {-wo.x, -wo.y, wo.z});
    DielectricBsdf black = bsdf.glass_bsdf;
    black.color = {};
    const Rgb mirrored = black.albedo(wo);
    const float usual = 1 - mirrored.g;
    albedo = mirrored * tint.reflected + bsdf.base_color * (usual * tint.passed);
    if (!(bsdf.glass_bsdf.roughness > 0 && tint.passed > 1)) return;
    const float kept = dielectric_albedo(wo.z, bsdf.glass_bsdf.roughness, bsdf.glass_bsdf.eta);
    scale = kept / (kept + (1 - kept) * std::max(1 - largest(tint.reflected), 0.0F));
  }
};

enum Lobe : std::size_t { kHighlight, kDiffuse, kSheet, kGlass, kSheen, kCoat, kLobes };

/// What is the same for all wi.
struct LayeredView {
  Highlight highlight;
  float coat;           ///< What the coat reflects.
  float beneath_sheen;  ///< Of what passes the coat.
  float passed;         ///< What the dielectric doesn't reflect.
  GlassView glass;
  std::array<Rgb, kLobes> albedos{};
  std::array<float, kLobes> shares{};  ///< The probabilities of drawing them; all 0 where all is black.

  LayeredView(const LayeredBsdf& bsdf, Vec3 wo)
      : highlight(std::min(wo.z, 1.0F), bsdf.roughness),
        coat(bsdf.clearcoat > 0 ? bsdf.clearcoat * (kCoatF0 + (1 - kCoatF0) * schlick(wo.z)) : 0),
        beneath_sheen(tessera::beneath_sheen(bsdf, wo.z)),
        passed(tessera::passed(bsdf, highlight)) {
    const float beneath = (1 - coat) * beneath_sheen;
    albedos[kHighlight] =
        reflected(bsdf, highlight.single.schlick_mean, highlight.lost) * (highlight.single.white * beneath);
    albedos[kDiffuse] = bsdf.base_color * (bsdf.diffuse * passed * beneath);
    albedos[kSheet] = bsdf.base_color * (bsdf.sheet * passed * beneath);
    if (bsdf.glass > 0) {
      glass = GlassView(bsdf, wo);
      albedos[kGlass] = glass.albedo * (bsdf.glass * beneath);
    }
    if (has_sheen(bsdf)) albedos[kSheen] = bsdf.sheen_color * (sheen_albedo(wo.z, bsdf.sheen_roughness) * (1 - coat));
    albedos[kCoat] = Rgb{coat, coat, coat};
    float sum = 0;
    for (const Rgb& albedo : albedos) sum += largest(albedo);
    if (sum > 0) std::ranges::transform(albedos, shares.begin(), [&](Rgb a) { return largest(a) / sum; });
  }
};

/// The lobe of a surface of which facets reflect all, once they have reflected it often enough.
BsdfValue white_lobe(float roughness, Vec3 wo, Vec3 wi) {
  const Ggx ggx{ggx_alpha(roughness)};
  const float density = ggx.density(half_vector(wo, wi)) / 4;
  const float f_cos = density * ggx.masked(wo, wi) / ggx_albedo(std::min(wo.z, 1.0F), roughness).white;
  return {{f_cos, f_cos, f_cos}, density * ggx.visible(wo)};
}

/// Of the base, without what is above it.
BsdfValue evaluate_base(const LayeredView& view, const LayeredBsdf& bsdf, Vec3 wo, Vec3 wi) {
  BsdfValue value;
  if (wi.z > 0) {
    if (bsdf.diffuse > 0) {
      const float pdf = cosine_hemisphere_pdf(wi.z);
      const float passed_in = passed(bsdf, Highlight(std::min(wi.z, 1.0F), bsdf.roughness));
      value.f_cos = bsdf.base_color * (bsdf.diffuse * view.passed) * (passed_in / bsdf.base_mean * pdf);
      value.pdf = view.shares[kDiffuse] * pdf;
    }
    if (bsdf.roughness > 0) {
      const Ggx ggx{ggx_alpha(bsdf.roughness)};
      const Vec3 h = half_vector(wo, wi);
      const float density = ggx.density(h) / 4;
      value.f_cos =
          value.f_cos + reflected(bsdf, schlick(cosine(wo, h)), view.highlight.lost) * (density * ggx.masked(wo, wi));
      value.pdf += view.shares[kHighlight] * density * ggx.visible(wo);
    }
  } else if (bsdf.sheet > 0 && bsdf.sheet_roughness > 0) {
    const BsdfValue sheet = white_lobe(bsdf.sheet_roughness, wo, {wi.x, wi.y, -wi.z});
    value.f_cos = bsdf.base_color * sheet.f_cos * (bsdf.sheet * view.passed);
    value.pdf = view.shares[kSheet] * sheet.pdf;
  }
  if (bsdf.glass > 0) {
    const BsdfValue glass = bsdf.glass_bsdf.evaluate(wo, wi);
    if (glass.pdf > 0) {
      const GlassTint tint(bsdf, wo, wi);
      value.f_cos = value.f_cos + glass.f_cos * (wi.z > 0 ? tint.reflected : Rgb{1, 1, 1} * tint.passed) *
                                      (bsdf.glass * view.glass.scale);
      value.pdf += view.shares[kGlass] * glass.pdf;
    }
  }
  return value;
}

/// What reaches the base and comes back from it; by the lesser of what the sheen lets pass on both ways.
float reaches_base(const LayeredView& view, const LayeredBsdf& bsdf, Vec3 wi) {
  const float both = has_sheen(bsdf) ? std::min(view.beneath_sheen, beneath_sheen(bsdf, std::abs(wi.z))) : 1;
  return (1 - view.coat) * both;
}

BsdfValue evaluate_from(const LayeredView& view, const LayeredBsdf& bsdf, Vec3 wo, Vec3 wi) {
  BsdfValue value = evaluate_base(view, bsdf, wo, wi);
  value.f_cos = value.f_cos * reaches_base(view, bsdf, wi);
  if (!(wi.z > 0)) return value;
  if (has_sheen(bsdf)) {
    const float sheen = Sheen(wo, bsdf.sheen_roughness).evaluate(wo, wi);
    value.f_cos = value.f_cos + bsdf.sheen_color * (sheen * (1 - view.coat));
    value.pdf += view.shares[kSheen] * 2 * kUniformSpherePdf;
  }
  if (view.coat > 0 && bsdf.clearcoat_roughness > 0) {
    const BsdfValue coat = white_lobe(bsdf.clearcoat_roughness, wo, wi);
    value.f_cos = value.f_cos + coat.f_cos * view.coat;
    value.pdf += view.shares[kCoat] * coat.pdf;
  }
  return value;
}

struct Chosen {
  Lobe lobe;
  float u;  ///< Where in its share; in [0, 1).
};

Chosen choose(const std::array<float, kLobes>& shares, float u) {
  std::size_t last = 0;
  for (std::size_t i = 0; i < kLobes; ++i) {
    if (!(shares[i] > 0)) continue;
    if (u < shares[i]) return {static_cast<Lobe>(i), below_one(u / shares[i])};
    u -= shares[i];
    last = i;
  }
  return {static_cast<Lobe>(last), below_one(1)};  // Rounding left it past the end.
}

Vec3 mirror_by_facet(float roughness, Vec3 wo, Vec2 u) {
  const Vec3 h = Ggx{ggx_alpha(roughness)}.sample_visible(wo, u);
  return h * (2 * cosine(wo, h)) - wo;
}

/// Even over the hemisphere.
Vec3 any_direction(Vec2 u) { return uniform_cone(u, 1); }

}  // namespace

LayeredBsdf bsdf_of(const Layered& surface, bool entering) {
  const float dielectric = 1 - surface.metallic;
  const float through = dielectric * surface.transmission;
  const float ratio = (surface.ior - 1) / (surface.ior + 1);
  LayeredBsdf bsdf{.base_color = surface.base_color,
                   .roughness = effective_roughness(surface.roughness),
                   .metal = surface.metallic,
                   .coated = surface.thin ? dielectric : dielectric - through,
                   .diffuse = dielectric - through,
                   .sheet = surface.thin ? through : 0,
                   .glass = surface.thin ? 0 : through,
                   .f0 = at_most_one(surface.specular_color * (ratio * ratio)),
                   .specular = surface.specular,
                   .base_mean = 1,
                   .sheet_roughness = 0,
                   .glass_bsdf = {},
                   .tints_glass = surface.specular != 1 || surface.specular_color != Rgb{1, 1, 1},
                   .sheen_color = surface.sheen_color,
                   .sheen_roughness = surface.sheen_roughness,
                   .clearcoat = surface.clearcoat,
                   .clearcoat_roughness = effective_roughness(surface.clearcoat_roughness)};
  const float mean = 1 - bsdf.specular * mean_reflected(largest(bsdf.f0), bsdf.roughness);
  if (mean > 0)
    bsdf.base_mean = mean;
  else
    bsdf.diffuse = 0;  // Nothing reaches it.
  if (bsdf.sheet > 0)
    bsdf.sheet_roughness = surface.ior > 0
                               ? effective_roughness(surface.roughness * std::clamp(2 * surface.ior - 2, 0.0F, 1.0F))
                               : bsdf.roughness;
  if (bsdf.glass > 0) {
    const float ior = surface.ior > 0 ? surface.ior : kLargestIor;
    bsdf.glass_bsdf = bsdf_of(Dielectric{ior, surface.roughness, surface.base_color}, entering);
    // What lies on it is outside.
    if (!entering) {
      bsdf.clearcoat = 0;
      bsdf.sheen_color = {};
    }
  }
  return bsdf;
}

BsdfValue LayeredBsdf::evaluate(Vec3 wo, Vec3 wi) const {
  if (!(wo.z > 0) || wi.z == 0) return {};
  return evaluate_from(LayeredView(*this, wo), *this, wo, wi);
}

std::optional<BsdfSample> LayeredBsdf::sample(Vec3 wo, float u_lobe, Vec2 u) const {
  if (!(wo.z > 0)) return std::nullopt;
  const LayeredView view(*this, wo);
  const Chosen chosen = choose(view.shares, u_lobe);
  const float share = view.shares[chosen.lobe];
  if (!(share > 0)) return std::nullopt;
  const auto delta = [&](Vec3 wi) {
    return BsdfSample{.wi = wi,
                      .weight = view.albedos[chosen.lobe] * (1 / share),
                      .pdf = share,
                      .is_delta = true,
                      .transmits = wi.z < 0};
  };
  const Vec3 mirrored{-wo.x, -wo.y, wo.z};
  Vec3 wi;
  float eta_scale = 1;
  switch (chosen.lobe) {
    case kHighlight:
      if (roughness == 0) return delta(mirrored);
      wi = mirror_by_facet(roughness, wo, u);
      break;
    case kCoat:
      if (clearcoat_roughness == 0) return delta(mirrored);
      wi = mirror_by_facet(clearcoat_roughness, wo, u);
      break;
    case kSheet:
      if (sheet_roughness == 0) return delta(-wo);
      wi = mirror_by_facet(sheet_roughness, wo, u);
      if (!(wi.z > 0)) return std::nullopt;
      wi.z = -wi.z;
      break;
    case kGlass: {
      auto glassy = glass_bsdf.sample(wo, chosen.u, u);
      if (!glassy) return std::nullopt;
      wi = glassy->wi;
      eta_scale = glassy->eta_scale;
      if (!glassy->is_delta) break;
      const GlassTint tint(*this, wo, wi);
      glassy->weight = glassy->weight * (wi.z > 0 ? tint.reflected : Rgb{1, 1, 1} * tint.passed) *
                       (glass * reaches_base(view, *this, wi) / share);
      glassy->pdf *= share;
      return glassy;
    }
    case kSheen:
      wi = any_direction(u);
      break;
    default:
      wi = cosine_hemisphere(u);
  }
  const bool transmits = wi.z < 0;
  const bool may_transmit = chosen.lobe == kSheet || chosen.lobe == kGlass;
  if (wi.z == 0 || (transmits && !may_transmit)) return std::nullopt;
  const BsdfValue value = evaluate_from(view, *this, wo, wi);
  if (!(value.pdf > 0)) return std::nullopt;
  return BsdfSample{.wi = wi,
                    .weight = value.f_cos * (1 / value.pdf),
                    .pdf = value.pdf,
                    .transmits = transmits,
                    .eta_scale = eta_scale};
}

bool LayeredBsdf::has_smooth_lobes() const {
  return roughness > 0 || diffuse > 0 || (clearcoat > 0 && clearcoat_roughness > 0) || has_sheen(*this) ||
         (glass > 0 && glass_bsdf.has_smooth_lobes()) || has_smooth_transmission();
}

bool LayeredBsdf::has_smooth_transmission() const {
  if (base_color.is_black()) return false;
  return (sheet > 0 && sheet_roughness > 0) || (glass > 0 && glass_bsdf.has_smooth_transmission());
}

Rgb LayeredBsdf::albedo(Vec3 wo) const {
  const Vec3 up{wo.x, wo.y, std::max(wo.z, 1e-6F)};
  LayeredView view(*this, up);
  if (has_sheen(*this) && view.beneath_sheen > 0)  // Of what is scattered evenly it takes on the way out, too.
    view.albedos[kDiffuse] =
        view.albedos[kDiffuse] *
        (hemisphere_mean([&](float c) { return std::min(view.beneath_sheen, beneath_sheen(*this, c)); }) /
         view.beneath_sheen);
  Rgb sum;
  for (const Rgb& lobe : view.albedos) sum = sum + lobe;
  return sum;
}

}  // namespace tessera

#include "core/material/whitted_bsdf.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/material/fresnel.h"
#include "core/material/shade.h"
#include "core/math/portable.h"
#include "core/math/portable_float.h"
#include "core/sampling/warp.h"

namespace tessera {
namespace {

constexpr Vec3 kNormal{0, 0, 1};

/// What each lobe sends back of even light.
struct Lobes {
  Rgb diffuse{}, specular{}, mirrored{}, bent{};
  Vec3 bent_direction{};
};

Lobes lobes_of(const WhittedBsdf& bsdf, Vec3 wo) {
  const WhittedSurface& s = bsdf.surface;
  Lobes lobes{.diffuse = s.diffuse, .specular = s.specular * (2 / (s.shininess + 1))};
  if (s.reflect.is_black() && s.transmit.is_black()) return lobes;
  const float sin2 = wo.x * wo.x + wo.y * wo.y;
  const float reflected = s.fresnel ? dielectric_fresnel(std::min(wo.z, 1.0F), sin2, bsdf.eta) : 1;
  lobes.mirrored = s.reflect * reflected;
  const float cos2_bent = 1 - sin2 / (bsdf.eta * bsdf.eta);
  if (cos2_bent > 0) lobes.bent = s.transmit * (s.fresnel ? 1 - reflected : 1);
  lobes.bent_direction = {-wo.x / bsdf.eta, -wo.y / bsdf.eta, -std::sqrt(std::max(cos2_bent, 0.0F))};
  return lobes;
}

/// The probabilities of choosing them; all 0 of a black surface.
struct Shares {
  float diffuse, specular, mirrored, bent;
};

Shares shares_of(const Lobes& lobes) {
  const float diffuse = largest(lobes.diffuse), specular = largest(lobes.specular);
  const float mirrored = largest(lobes.mirrored), bent = largest(lobes.bent);
  const float sum = diffuse + specular + mirrored + bent;
  if (!(sum > 0)) return {};
  return {diffuse / sum, specular / sum, mirrored / sum, bent / sum};
}

float pdf_of(const WhittedSurface& surface, const Shares& shares, Vec3 wo, Vec3 wi) {
  float pdf = shares.diffuse * cosine_hemisphere_pdf(wi.z);
  const float cos_alpha = std::min(dot(mirror(-wo, kNormal), wi), 1.0F);
  if (shares.specular > 0 && cos_alpha > 0)
    pdf += shares.specular * (surface.shininess + 1) * (std::numbers::inv_pi_v<float> / 2) *
           portable_pow(cos_alpha, surface.shininess);
  return pdf;
}

/// Around the mirrored wo with density ∝ cos^shininess; may lie below the horizon. In double, as the angles of high
/// exponents are small.
Vec3 sample_highlight(float shininess, Vec3 wo, Vec2 u) {
  const double log_cos = portable_log2(1 - double{u.x}) / (double{shininess} + 1);
  const auto cos_alpha = static_cast<float>(portable_exp2(log_cos));
  const auto sin_alpha = static_cast<float>(std::sqrt(std::max(1 - portable_exp2(2 * log_cos), 0.0)));
  const auto [s, c] = sin_cos_turns(u.y);
  return basis_around(mirror(-wo, kNormal)).to_world({sin_alpha * c, sin_alpha * s, cos_alpha});
}

}  // namespace

WhittedBsdf bsdf_of(const WhittedSurface& surface, bool entering) {
  return {surface, entering ? surface.ior : 1 / surface.ior};
}

BsdfValue WhittedBsdf::evaluate(Vec3 wo, Vec3 wi) const {
  if (!(wo.z > 0 && wi.z > 0) || !has_smooth_lobes()) return {};
  return {shade(surface, kNormal, wo, wi, {1, 1, 1}), pdf_of(surface, shares_of(lobes_of(*this, wo)), wo, wi)};
}

std::optional<BsdfSample> WhittedBsdf::sample(Vec3 wo, float u_lobe, Vec2 u) const {
  if (!(wo.z > 0)) return std::nullopt;
  const Lobes lobes = lobes_of(*this, wo);
  const Shares shares = shares_of(lobes);
  const float smooth = shares.diffuse + shares.specular;
  if (u_lobe < smooth) {
    const Vec3 wi = u_lobe < shares.diffuse ? cosine_hemisphere(u) : sample_highlight(surface.shininess, wo, u);
    if (!(wi.z > 0)) return std::nullopt;
    const float pdf = pdf_of(surface, shares, wo, wi);
    if (!(pdf > 0)) return std::nullopt;
    return BsdfSample{.wi = wi, .weight = shade(surface, kNormal, wo, wi, {1, 1, 1}) * (1 / pdf), .pdf = pdf};
  }
  if (shares.mirrored > 0 && (u_lobe < smooth + shares.mirrored || shares.bent == 0))
    return BsdfSample{.wi = mirror(-wo, kNormal),
                      .weight = lobes.mirrored * (1 / shares.mirrored),
                      .pdf = shares.mirrored,
                      .is_delta = true};
  if (shares.bent > 0)
    return BsdfSample{.wi = lobes.bent_direction,
                      .weight = lobes.bent * (1 / shares.bent),
                      .pdf = shares.bent,
                      .is_delta = true,
                      .transmits = true};
  return std::nullopt;
}

Rgb WhittedBsdf::albedo(Vec3 wo) const {
  const Lobes lobes = lobes_of(*this, wo);
  const Rgb sum = lobes.diffuse + lobes.specular + lobes.mirrored + lobes.bent;
  return {std::min(sum.r, 1.0F), std::min(sum.g, 1.0F), std::min(sum.b, 1.0F)};
}

}  // namespace tessera

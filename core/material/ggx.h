#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/math/portable_float.h"
#include "core/math/vec.h"
#include "core/math/vec2.h"

namespace tessera {

/// The alpha of GGX that a roughness as people set it stands for.
inline float ggx_alpha(float roughness) { return roughness * roughness; }

/// Below this a surface is smooth, and its lobes are deltas. At the alpha that goes with it (1e-4) a lobe is a
/// hundredth of a degree wide, and the roundings of unit vectors still don't show in its densities.
inline constexpr float kLeastRoughness = 0.01F;

/// What a roughness means: 0 (smooth) or in [kLeastRoughness, 1].
inline float effective_roughness(float roughness) {
  return roughness >= kLeastRoughness ? std::min(roughness, 1.0F) : 0;
}

/// The micronormal that mirrors one direction into the other, both with z > 0; also of those that lie opposite each
/// other in the horizon but for less than can be squared.
inline Vec3 half_vector(Vec3 wo, Vec3 wi) {
  const Vec3 sum = wo + wi;
  const float size = length(sum);
  return size > 0 ? sum / size : Vec3{0, 0, 1};
}

/// Of the angle between unit vectors that is at most π/2, but for rounding: in [0, 1].
inline float cosine(Vec3 a, Vec3 b) { return std::clamp(dot(a, b), 0.0F, 1.0F); }

/// The GGX distribution of micronormals (Trowbridge & Reitz 1975, Walter et al. 2007) with Smith's masking and
/// shadowing, the heights of both correlated (Heitz 2014). z is the macroscopic normal; `wo` has z > 0, all directions
/// are unit. `alpha` ≥ 1e-4. Terms come divided by cos θo, as that's where they are needed: nothing divides by 0 then.
struct Ggx {
  float alpha;

  /// D(h), h.z ≥ 0.
  float density(Vec3 h) const {
    const float a2 = alpha * alpha, t = h.x * h.x + h.y * h.y + a2 * h.z * h.z;
    return a2 * std::numbers::inv_pi_v<float> / (t * t);
  }

  /// cos θ · (1 + 2 Λ): the length of a direction in the stretched space in which the surface's alpha is 1.
  float stretched(Vec3 w) const { return std::sqrt(alpha * alpha * (w.x * w.x + w.y * w.y) + w.z * w.z); }

  /// G1(wo) / cos θo: times D(h) · (wo · h), the density of micronormals that are seen.
  float visible(Vec3 wo) const { return 2 / (wo.z + stretched(wo)); }

  /// G2(wo, wi) / cos θo, for wi on either side.
  float masked(Vec3 wo, Vec3 wi) const { return 2 / (stretched(wo) + stretched(wi) * (wo.z / std::abs(wi.z))); }

  /// A micronormal that is seen from `wo`, its z > 0; density D(h) · visible(wo) · (wo · h). By spherical caps (Dupuy &
  /// Benyoub 2023).
  Vec3 sample_visible(Vec3 wo, Vec2 u) const {
    const Vec3 up = Vec3{alpha * wo.x, alpha * wo.y, wo.z} / stretched(wo);
    const auto [sin_phi, cos_phi] = sin_cos_turns(u.x);
    const float below_top = u.y * (1 + up.z);  // The cap of directions with z > -up.z, evenly.
    const float radius = std::sqrt(below_top * std::max(2 - below_top, 0.0F));
    const Vec3 h{alpha * (radius * cos_phi + up.x), alpha * (radius * sin_phi + up.y), (1 - u.y) * (1 + up.z)};
    return h / length(h);
  }
};

}  // namespace tessera

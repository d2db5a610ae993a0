#pragma once

#include <optional>

#include "core/material/bsdf_sample.h"
#include "core/math/vec2.h"
#include "core/scene/material.h"

namespace tessera {

/// glTF 2.0's material (its appendix B): by `metallic`, a mix of a metal, whose reflectance at normal incidence is
/// `base_color`, and of a dielectric of reflectance 0.04 over a diffuse base; both with GGX and Schlick's Fresnel. The
/// appendix leaves open how the highlight's energy is kept and what the base loses to it. Here Turquin's scale gives
/// back what scatters more than once, as in conductor_bsdf.h; and the base gets what the coat lets pass on the way in
/// and on the way out, (1 - E(wo)) (1 - E(wi)) / (1 - E_avg) (Ashikhmin & Shirley 2000; Kelemen & Szirmay-Kalos 2001),
/// so that no more comes back than came and a white one sends back all. Reciprocal but for Turquin's scale of the
/// highlight.
struct MetallicRoughnessBsdf {
  Rgb base_color;
  float metallic;
  float roughness;  ///< As `effective_roughness` gives it.
  float base_mean;  ///< E_avg's complement: what the coat lets pass of even light.

  BsdfValue evaluate(Vec3 wo, Vec3 wi) const;
  std::optional<BsdfSample> sample(Vec3 wo, float u_lobe, Vec2 u) const;
  bool has_smooth_lobes() const { return roughness > 0 || metallic < 1; }
  bool has_smooth_transmission() const { return false; }
  bool has_one_lobe() const { return false; }
  Rgb albedo(Vec3 wo) const;
};

MetallicRoughnessBsdf bsdf_of(const MetallicRoughness& surface, bool entering);

}  // namespace tessera

#pragma once

#include <optional>

#include "core/material/bsdf_sample.h"
#include "core/math/vec2.h"
#include "core/scene/material.h"

namespace tessera {

/// A metal's surface: smooth, a mirror; rough, GGX with what scatters more than once given back by scaling (Turquin
/// 2019, Practical multiple scattering compensation for microfacet models). The scale depends on wo alone, so a rough
/// one is reciprocal but for that factor.
struct ConductorBsdf {
  Rgb eta, k;
  float roughness;        ///< As `effective_roughness` gives it.
  Rgb average_fresnel{};  ///< Over the hemisphere, by cos θ; of a rough one.

  BsdfValue evaluate(Vec3 wo, Vec3 wi) const;
  std::optional<BsdfSample> sample(Vec3 wo, float u_lobe, Vec2 u) const;
  bool has_smooth_lobes() const { return roughness > 0; }
  bool has_smooth_transmission() const { return false; }
  bool has_one_lobe() const { return true; }
  Rgb albedo(Vec3 wo) const;
};

ConductorBsdf bsdf_of(const Conductor& surface, bool entering);

}  // namespace tessera

#pragma once

#include <optional>

#include "core/material/bsdf_sample.h"
#include "core/math/vec2.h"
#include "core/scene/material.h"

namespace tessera {

/// The surface of glass, seen from one side. Smooth, it reflects and refracts by Fresnel's equations. Rough, its facets
/// do (Walter et al. 2007, Microfacet Models for Refraction through Rough Surfaces), and what scatters more than once
/// is given back by dividing by what a single scattering keeps (Turquin 2019, as in conductor_bsdf.h): all light that
/// comes leaves, but for what `color` takes from that which passes. Radiance that passes is scaled by 1/eta².
struct DielectricBsdf {
  float eta;        ///< The index of the far side relative to the near one.
  float roughness;  ///< As `effective_roughness` gives it; 0, too, where both sides are all but the same.
  Rgb color;

  BsdfValue evaluate(Vec3 wo, Vec3 wi) const;
  std::optional<BsdfSample> sample(Vec3 wo, float u_lobe, Vec2 u) const;
  bool has_smooth_lobes() const { return roughness > 0; }
  bool has_smooth_transmission() const { return roughness > 0 && !color.is_black(); }
  bool has_one_lobe() const { return false; }
  Rgb albedo(Vec3 wo) const;
};

DielectricBsdf bsdf_of(const Dielectric& surface, bool entering);

}  // namespace tessera

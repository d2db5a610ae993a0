#pragma once

#include "core/material/fresnel.h"
#include "core/material/ggx_albedo.h"

namespace tessera {

/// What facets of reflectance `f0` at normal incidence reflect, by Schlick, and what comes back of it later. `lost` is
/// what the facets lose of white light by what they keep.
inline float facets_reflect(float f0, float schlick_term, float lost) {
  return (f0 + (1 - f0) * schlick_term) * (1 + f0 * lost);
}

/// A highlight of GGX and Schlick's Fresnel as a whole, from one direction. `roughness` as `effective_roughness` gives
/// it.
struct Highlight {
  GgxAlbedo single;  ///< Without what scatters more than once.
  float lost;

  Highlight(float cos_theta, float roughness)
      : single(roughness > 0 ? ggx_albedo(cos_theta, roughness) : GgxAlbedo{1, schlick(cos_theta)}),
        lost(1 / single.white - 1) {}

  /// What facets of reflectance `f0` don't reflect.
  float passed(float f0) const { return 1 - single.white * facets_reflect(f0, single.schlick_mean, lost); }
};

}  // namespace tessera

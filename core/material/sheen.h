#pragma once

#include "core/math/vec.h"

namespace tessera {

/// Below this, sheen is as at it: the fibres' lobe lies in the horizon alone.
inline constexpr float kLeastSheenRoughness = 0.07F;

/// The sheen of cloth as KHR_materials_sheen has it: the "Charlie" distribution of fibres, with its fit of what they
/// hide of each other (Estevez & Kulla 2017, Production Friendly Microfacet Sheen BRDF). Directions are unit, z > 0.
/// The fit has more come back than came where it is seen along the horizon and the roughness is small; the lobe is
/// scaled down there by a factor of wo, so that all does.
class Sheen {
 public:
  /// What is the same for all wi. `roughness` in [0, 1].
  Sheen(Vec3 wo, float roughness);

  /// f · cos θi of a white sheen, 1/sr.
  float evaluate(Vec3 wo, Vec3 wi) const;

 private:
  float alpha_;
  float hidden_;  ///< Λ of wo.
  float scale_;
};

/// What comes back of even light by a white sheen, in 0..1. `roughness` in [0, 1], `cos_theta` of wo.
float sheen_albedo(float cos_theta, float roughness);

}  // namespace tessera

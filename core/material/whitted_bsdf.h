#pragma once

#include <optional>

#include "core/material/bsdf_sample.h"
#include "core/math/vec2.h"
#include "core/scene/material.h"

namespace tessera {

/// Whitted's surface as a BSDF: `shade`'s formula, and deltas of the weights with which Whitted's integrator traces
/// mirror and refraction rays. It is what it was: more may come back than came, it isn't reciprocal, and radiance isn't
/// scaled by 1/eta².
struct WhittedBsdf {
  WhittedSurface surface;
  float eta;  ///< The index of the far side relative to the near one.

  BsdfValue evaluate(Vec3 wo, Vec3 wi) const;
  std::optional<BsdfSample> sample(Vec3 wo, float u_lobe, Vec2 u) const;
  bool has_smooth_lobes() const { return !(surface.diffuse.is_black() && surface.specular.is_black()); }
  bool has_smooth_transmission() const { return false; }
  bool has_one_lobe() const { return false; }
  Rgb albedo(Vec3 wo) const;
};

WhittedBsdf bsdf_of(const WhittedSurface& surface, bool entering);

}  // namespace tessera

#pragma once

#include <numbers>
#include <optional>

#include "core/material/bsdf_sample.h"
#include "core/math/vec2.h"
#include "core/sampling/warp.h"
#include "core/scene/material.h"

namespace tessera {

/// Lambert's: `color` is what comes back, evenly.
struct DiffuseBsdf {
  Rgb color;

  BsdfValue evaluate(Vec3 wo, Vec3 wi) const {
    if (!(wo.z > 0 && wi.z > 0)) return {};
    const float pdf = cosine_hemisphere_pdf(wi.z);
    return {color * pdf, pdf};
  }
  std::optional<BsdfSample> sample(Vec3 wo, float, Vec2 u) const {
    const Vec3 wi = cosine_hemisphere(u);
    if (!(wo.z > 0 && wi.z > 0)) return std::nullopt;
    return BsdfSample{.wi = wi, .weight = color, .pdf = cosine_hemisphere_pdf(wi.z)};
  }
  bool has_smooth_lobes() const { return !color.is_black(); }
  bool has_smooth_transmission() const { return false; }
  bool has_one_lobe() const { return true; }
  Rgb albedo(Vec3) const { return color; }
};

inline DiffuseBsdf bsdf_of(const Diffuse& surface, bool) { return {surface.color}; }

}  // namespace tessera

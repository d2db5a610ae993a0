#pragma once

#include <optional>

#include "core/material/bsdf_sample.h"
#include "core/math/vec2.h"
#include "core/scene/material.h"

namespace tessera {

/// Scatters nothing; `color` is what is seen of it.
struct UnlitBsdf {
  Rgb color;

  BsdfValue evaluate(Vec3, Vec3) const { return {}; }
  std::optional<BsdfSample> sample(Vec3, float, Vec2) const { return std::nullopt; }
  bool has_smooth_lobes() const { return false; }
  bool has_smooth_transmission() const { return false; }
  bool has_one_lobe() const { return true; }
  Rgb albedo(Vec3) const { return color; }
};

inline UnlitBsdf bsdf_of(const Unlit& surface, bool) { return {surface.color}; }

}  // namespace tessera

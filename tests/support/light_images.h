#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/scene/scene.h"
#include "core/scene/settings.h"
#include "tests/support/image.h"
#include "tests/support/statistics.h"

namespace tessera {

/// A square image of light.
inline Settings light_settings(IntegratorKind integrator, std::uint32_t side, std::uint32_t samples,
                               std::optional<std::uint32_t> max_depth = std::nullopt) {
  Settings settings;
  settings.width = settings.height = side;
  settings.samples = samples;
  settings.integrator = integrator;
  settings.max_depth = max_depth;
  return settings;
}

/// Of a channel over all pixels. Samplers are independent from pixel to pixel: where all pixels have one true value,
/// their mean is open to a t-test.
inline Moments moments_of(const Pixels& pixels, float Rgb::*channel = &Rgb::g) {
  Moments moments;
  for (const Rgb& c : pixels.color) moments.add(double{c.*channel});
  return moments;
}

/// The least and the largest number in an image.
struct Extremes {
  float least = kInfinity, most = -kInfinity;
  bool all_finite = true;
};
inline Extremes extremes_of(const Pixels& pixels) {
  Extremes found;
  for (const Rgb& c : pixels.color) {
    found.all_finite &= is_finite(c);
    found.least = std::min({found.least, c.r, c.g, c.b});
    found.most = std::max({found.most, c.r, c.g, c.b});
  }
  return found;
}

/// Looks straight down at (x, y, 0) from `height`: so narrow that all it sees has one true value.
inline Camera down_at(float x, float y, float height = 0.5F, float width = 1e-3F) {
  return OrthographicCamera{{{x, y, height}, {x, y, 0}, {0, 1, 0}}, width};
}

/// A horizontal square around (0, 0, z) that faces up, or down.
inline Quad horizontal(float half, float z, bool up = true) {
  const Vec3 a{-half, -half, z}, b{half, -half, z}, c{half, half, z}, d{-half, half, z};
  return up ? Quad{{a, b, c, d}} : Quad{{d, c, b, a}};
}

inline Rgb grey(float v) { return {v, v, v}; }

}  // namespace tessera

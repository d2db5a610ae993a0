#include "core/io/tone_map.h"

#include <algorithm>
#include <limits>

#include "core/math/portable.h"

namespace tessera {
namespace {

struct Color {
  double r, g, b;
};

double least(Color c) { return std::min({c.r, c.g, c.b}); }
double greatest(Color c) { return std::max({c.r, c.g, c.b}); }
Color operator*(Color c, double s) { return {c.r * s, c.g * s, c.b * s}; }

/// What is left of a channel before it is mapped.
double channel(float v) { return v > 0 ? std::min(v, std::numeric_limits<float>::max()) : 0.0; }

/// A dielectric's base colour looks brighter by what it reflects at normal incidence: that much is taken off, less of
/// what is darker. Up to `kStart` nothing else happens; above, the greatest channel nears 1, and the others near it.
Color khronos_pbr_neutral(Color c) {
  constexpr double kFresnel = 0.04, kStart = 0.8 - kFresnel, kDesaturation = 0.15;
  const double dark = least(c);
  const double offset = dark < 2 * kFresnel ? dark - dark * dark / (4 * kFresnel) : kFresnel;
  c = {c.r - offset, c.g - offset, c.b - offset};
  const double peak = greatest(c);
  if (peak <= kStart) return c;
  const double room = 1 - kStart;
  const double shown = 1 - room * room / (peak + room - kStart);
  const double white = 1 - 1 / (kDesaturation * (peak - shown) + 1);
  const Color bent = c * (shown / peak * (1 - white));
  return {bent.r + shown * white, bent.g + shown * white, bent.b + shown * white};
}

double aces_curve(double v) {
  return (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
}

/// Rec. 709 to the primaries that ACES renders in, with its desaturation; the curve; and back.
Color aces(Color c) {
  const Color in{aces_curve(0.59719 * c.r + 0.35458 * c.g + 0.04823 * c.b),
                 aces_curve(0.07600 * c.r + 0.90834 * c.g + 0.01566 * c.b),
                 aces_curve(0.02840 * c.r + 0.13383 * c.g + 0.83777 * c.b)};
  return {1.60475 * in.r - 0.53108 * in.g - 0.07367 * in.b,  //
          -0.10208 * in.r + 1.10813 * in.g - 0.00605 * in.b, -0.00327 * in.r - 0.07276 * in.g + 1.07602 * in.b};
}

Rgb rounded(Color c) { return {static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b)}; }

}  // namespace

Display::Display(const Look& look)
    : scale_(static_cast<float>(portable_exp2(look.exposure))), tone_map_(look.tone_map) {}

Rgb Display::operator()(Rgb radiance) const {
  const Rgb exposed = radiance * scale_;
  if (tone_map_ == ToneMap::none) return exposed;
  const Color color{channel(exposed.r), channel(exposed.g), channel(exposed.b)};
  return rounded(tone_map_ == ToneMap::aces ? aces(color) : khronos_pbr_neutral(color));
}

}  // namespace tessera

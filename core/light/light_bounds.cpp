#include "core/light/light_bounds.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/math/portable_float.h"

namespace tessera {
namespace {

/// As a point of the circle: products add angles.
struct Angle {
  double cos, sin;

  static Angle of(double cosine) { return {cosine, std::sqrt(std::max(0.0, 1 - cosine * cosine))}; }
};
Angle operator+(Angle a, Angle b) { return {a.cos * b.cos - a.sin * b.sin, a.sin * b.cos + a.cos * b.sin}; }
Angle operator-(Angle a, Angle b) { return a + Angle{b.cos, -b.sin}; }

/// Of an angle in [0, π].
Angle half(double cosine) {
  return {std::sqrt(std::max(0.0, 0.5 * (1 + cosine))), std::sqrt(std::max(0.0, 0.5 * (1 - cosine)))};
}

/// The cosine of the sum of two angles in [0, π], of which π is the most.
double cosine_of_sum(double cos_a, double cos_b) {
  return cos_a <= -cos_b ? -1 : (Angle::of(cos_a) + Angle::of(cos_b)).cos;
}

}  // namespace

EmissionCone EmissionCone::around(Vec3d direction) {
  const double l = length(direction);
  if (!(l > 0)) return {};
  return {direction / l, 1};
}

void EmissionCone::extend(const LightBounds& light) {
  const double cosine = std::clamp(dot(axis, to_double(light.axis)), -1.0, 1.0);
  cos_spread = std::min(cos_spread, cosine_of_sum(light.both_sides ? std::abs(cosine) : cosine, light.cos_spread));
  cos_reach = std::min(cos_reach, double{light.cos_reach});
  both_sides |= light.both_sides;
}

double EmissionCone::measure() const {
  const double spread = portable_acos(static_cast<float>(cos_spread));
  const double reach = portable_acos(static_cast<float>(cos_reach));
  const double whole = std::min(spread + reach, std::numbers::pi), sine = Angle::of(cos_spread).sin;
  const double cosine = portable_sin_cos(static_cast<float>(spread - 2 * whole)).cos;
  return std::numbers::pi * (2 - 2 * cos_spread + whole * sine - 0.5 * cosine - spread * sine + 0.5 * cos_spread);
}

EmissionCone united(const EmissionCone& a, const EmissionCone& b) {
  const bool a_is_wide = a.cos_spread <= b.cos_spread;
  const EmissionCone& narrow = a_is_wide ? b : a;
  EmissionCone out = a_is_wide ? a : b;
  out.cos_reach = std::min(a.cos_reach, b.cos_reach);
  out.both_sides = a.both_sides || b.both_sides;
  const double cosine = std::clamp(dot(out.axis, narrow.axis), -1.0, 1.0);
  const Vec3d toward = narrow.both_sides && cosine < 0 ? -narrow.axis : narrow.axis;
  const double between = narrow.both_sides ? std::abs(cosine) : cosine;
  if (cosine_of_sum(between, narrow.cos_spread) >= out.cos_spread) return out;

  // The axis turns by half of what the narrow cone sticks out, and the wide cone's spread grows by as much.
  const Angle spread = Angle::of(out.cos_spread);
  const Angle turn = half((Angle::of(between) + Angle::of(narrow.cos_spread) - spread).cos);
  const Angle grown = spread + turn;
  const Vec3d across = toward - between * out.axis;
  const double l = length(across);
  if (!(grown.sin > 0) || !(l > 0)) {
    out.cos_spread = -1;
    return out;
  }
  out.axis = turn.cos * out.axis + (turn.sin / l) * across;
  out.cos_spread = grown.cos;
  return out;
}

}  // namespace tessera

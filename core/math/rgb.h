#pragma once

#include <algorithm>
#include <cmath>

namespace tessera {

/// Linear Rec. 709 colour: radiance in W/(sr m²), or a reflectance in 0..1, as the name beside it says.
struct Rgb {
  float r{}, g{}, b{};

  constexpr bool operator==(const Rgb&) const = default;
  constexpr bool is_black() const { return r == 0 && g == 0 && b == 0; }
};

constexpr Rgb operator+(Rgb a, Rgb b) { return {a.r + b.r, a.g + b.g, a.b + b.b}; }
constexpr Rgb operator*(Rgb a, Rgb b) { return {a.r * b.r, a.g * b.g, a.b * b.b}; }
constexpr Rgb operator*(Rgb a, float s) { return {a.r * s, a.g * s, a.b * s}; }
constexpr Rgb operator*(float s, Rgb a) { return a * s; }

constexpr float largest(Rgb c) { return std::max({c.r, c.g, c.b}); }
constexpr double mean(Rgb c) { return (double{c.r} + c.g + c.b) / 3; }

inline bool is_finite(Rgb c) { return std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b); }

}  // namespace tessera

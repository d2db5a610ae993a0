#include "core/light/spherical_triangle.h"

#include <algorithm>
#include <cmath>

#include "core/math/portable_float.h"

namespace tessera {
namespace {

/// Twice the area by the square of the distance of the nearest corner. The density by area changes little over what is
/// smaller than that.
constexpr double kLarge = 0.3;
/// The least distance from the triangle's plane, by the root of twice its area.
constexpr double kAbove = 0x1p-10;
constexpr double kLeastSolidAngle = 0x1p-6;

double root(double square) { return std::sqrt(std::max(0.0, square)); }

}  // namespace

std::optional<SphericalTriangle> SphericalTriangle::seen(Vec3d a, Vec3d b, Vec3d c) {
  const Vec3d normal = cross(b - a, c - a);
  const double nearest = std::min(dot(a, a), std::min(dot(b, b), dot(c, c)));
  const double twice_area_2 = dot(normal, normal), above = dot(normal, a);
  if (!(twice_area_2 >= kLarge * kLarge * nearest * nearest)) return std::nullopt;
  if (!(above * above >= kAbove * kAbove * twice_area_2 * std::sqrt(twice_area_2))) return std::nullopt;
  const SphericalTriangle triangle(a / length(a), b / length(b), c / length(c));
  if (!(triangle.solid_angle_ >= kLeastSolidAngle)) return std::nullopt;
  return triangle;
}

/// The solid angle after Van Oosterom & Strackee 1983.
SphericalTriangle::SphericalTriangle(Vec3d a, Vec3d b, Vec3d c)
    : a_(a),
      b_(b),
      c_(c),
      solid_angle_(2 * portable_detail::angle(std::abs(dot(a, cross(b, c))), 1 + dot(a, b) + dot(b, c) + dot(c, a))) {}

/// Part of the area, from the side ab on, ends at a side through b and a point between a and c; the direction lies
/// between b and that point.
Vec3d SphericalTriangle::sample(Vec2 u) const {
  const Vec3d across_ab = cross(a_, b_), across_ac = cross(a_, c_);
  const double cos_a = dot(across_ab, across_ac) / std::sqrt(dot(across_ab, across_ab) * dot(across_ac, across_ac));
  const double sin_a = root(1 - cos_a * cos_a), cos_ab = dot(a_, b_);
  const auto [sin_part, cos_part] = portable_sin_cos(static_cast<float>(u.x * solid_angle_));
  // Of the part's area less the angle at a.
  const double s = sin_part * cos_a - cos_part * sin_a, t = cos_part * cos_a + sin_part * sin_a;
  const double v = t - cos_a, w = s + sin_a * cos_ab;
  const double cos_end = std::clamp(((w * t - v * s) * cos_a - w) / ((w * s + v * t) * sin_a), -1.0, 1.0);
  const Vec3d from_a = c_ - a_ * dot(c_, a_);
  const Vec3d end = a_ * cos_end + from_a * (root(1 - cos_end * cos_end) / length(from_a));
  const double cos_b = dot(end, b_), along = 1 - u.y * (1 - cos_b);
  const Vec3d from_b = end - b_ * cos_b;
  return b_ * along + from_b * (root(1 - along * along) / length(from_b));
}

}  // namespace tessera

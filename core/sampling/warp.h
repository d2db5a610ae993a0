#pragma once

#include <cmath>
#include <numbers>

#include "core/math/portable_float.h"
#include "core/math/vec.h"
#include "core/math/vec2.h"

namespace tessera {

// Maps from the unit square to what is sampled, which keep areas: a `u` that is uniform in [0, 1)² becomes a point or
// direction that is uniform (or as the name says) in the target, and near points stay near, so that samples that are
// spread well stay so. Directions have length 1 to rounding and are local, around +z. Densities of directions are per
// solid angle. All are pure and the same on every machine; NaN in, NaN out.

/// As a float in [0, 1). Precondition: x in [0, 1].
constexpr float below_one(double x) { return static_cast<float>(x < 1 - 0x1p-24 ? x : 1 - 0x1p-24); }

/// Uniform in the disk of radius 1, the concentric map (Shirley & Chiu 1997): the square's centre becomes the disk's.
inline Vec2 uniform_disk(Vec2 u) {
  const float x = 2 * u.x - 1, y = 2 * u.y - 1;
  const bool flat = std::abs(x) > std::abs(y);
  const float radius = flat ? x : y;
  const float ratio = radius == 0 ? 0 : (flat ? y : x) / radius;
  const auto [s, c] = sin_cos_turns(ratio / 8);
  return flat ? Vec2{radius * c, radius * s} : Vec2{radius * s, radius * c};
}

/// A direction in the upper hemisphere with density cos θ / π (Malley's method). z can be 0 where u is on the square's
/// edge.
inline Vec3 cosine_hemisphere(Vec2 u) {
  const Vec2 d = uniform_disk(u);
  const float square = 1 - (d.x * d.x + d.y * d.y);
  return {d.x, d.y, std::sqrt(square < 0 ? 0 : square)};
}
/// Its density; 0 below the horizon.
constexpr float cosine_hemisphere_pdf(float cos_theta) {
  return cos_theta > 0 ? cos_theta * std::numbers::inv_pi_v<float> : 0;
}

/// Uniform in the cone of directions around +z whose cosine with it is at least 1 - `one_minus_cos`, which is in (0,
/// 2]: thus the narrowest cones keep their digits. The disk's map, lifted (Shirley & Chiu 1997).
inline Vec3 uniform_cone(Vec2 u, float one_minus_cos) {
  const Vec2 d = uniform_disk(u);
  const float height = (d.x * d.x + d.y * d.y) * one_minus_cos;
  const float rest = 2 - height;
  const float scale = std::sqrt(one_minus_cos * (rest < 0 ? 0 : rest));
  return {d.x * scale, d.y * scale, 1 - height};
}
/// Its density inside the cone.
constexpr float uniform_cone_pdf(float one_minus_cos) { return std::numbers::inv_pi_v<float> / 2 / one_minus_cos; }

/// Uniform over all directions.
inline Vec3 uniform_sphere(Vec2 u) { return uniform_cone(u, 2); }
inline constexpr float kUniformSpherePdf = std::numbers::inv_pi_v<float> / 4;

/// Uniform in a triangle: the barycentric coordinates of two of its corners, the third's being what lacks to 1
/// (Heitz 2019, A Low-Distortion Map Between Triangle and Square).
constexpr Vec2 uniform_triangle(Vec2 u) {
  return u.y > u.x ? Vec2{u.x / 2, u.y - u.x / 2} : Vec2{u.x - u.y / 2, u.y / 2};
}

/// Three unit vectors, each perpendicular to the others, right-handed.
struct Basis {
  Vec3 x, y, z;

  constexpr Vec3 to_world(Vec3 local) const { return x * local.x + y * local.y + z * local.z; }
  constexpr Vec3 to_local(Vec3 world) const { return {dot(world, x), dot(world, y), dot(world, z)}; }
};

/// A basis whose z is `z`, of length 1; continuous but where z.z changes its sign (Duff et al. 2017, Building an
/// Orthonormal Basis, Revisited, JCGT 6(1)).
inline Basis basis_around(Vec3 z) {
  const float sign = std::copysign(1.0F, z.z);
  const float a = -1 / (sign + z.z);
  const float b = z.x * z.y * a;
  return {{1 + sign * z.x * z.x * a, sign * b, -sign * z.x}, {b, sign + z.y * z.y * a, -z.y}, z};
}

}  // namespace tessera

#include "core/light/infinite_lights.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/math/portable.h"
#include "core/sampling/warp.h"

namespace tessera {
namespace {

constexpr double kPi = std::numbers::pi;

/// A sun with a smaller diameter is a directional light: unit directions of floats are hardly finer.
constexpr float kSmallestSun = 1e-5F;

Vec3 times(const std::array<float, 9>& m, Vec3 v) {
  return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
          m[6] * v.x + m[7] * v.y + m[8] * v.z};
}
Vec3 times_transposed(const std::array<float, 9>& m, Vec3 v) {
  return {m[0] * v.x + m[3] * v.y + m[6] * v.z, m[1] * v.x + m[4] * v.y + m[7] * v.z,
          m[2] * v.x + m[5] * v.y + m[8] * v.z};
}

Vec3 unit(Vec3 v) { return UnitVec3::normalize(v).value_or(UnitVec3::z()); }

}  // namespace

InfiniteLights::InfiniteLights(const Scene& scene) {
  for (const Light& light : scene.lights) {
    if (const auto* directional = std::get_if<DirectionalLight>(&light)) add(*directional);
    if (const auto* sun = std::get_if<SunLight>(&light)) add(*sun);
  }
  add(environment_of(scene));

  // So far shares are irradiances.
  double total = environment_share_;
  for (const Directional& light : directional_) total += light.share;
  for (const Sun& sun : suns_) total += sun.share;
  const double count = size();
  const auto settle = [&](double& share) { share = 0.5 / count + 0.5 * share / total; };
  for (Directional& light : directional_) settle(light.share);
  for (Sun& sun : suns_) settle(sun.share);
  if (has_environment_) settle(environment_share_);
}

void InfiniteLights::add(const DirectionalLight& light) {
  if (!light.irradiance.is_black())
    directional_.push_back({-light.direction, light.irradiance, mean(light.irradiance)});
}

void InfiniteLights::add(const SunLight& light) {
  if (light.angle < kSmallestSun) return add(DirectionalLight{light.direction, light.irradiance});
  if (light.irradiance.is_black()) return;
  const double sine = portable_sin(light.angle / 2.0), half_sine = portable_sin(light.angle / 4.0);
  suns_.push_back({basis_around(-light.direction), static_cast<float>(2 * half_sine * half_sine),
                   light.irradiance * static_cast<float>(1 / (kPi * sine * sine)), mean(light.irradiance)});
}

void InfiniteLights::add(const EnvironmentLight& light) {
  environment_radiance_ = light.radiance;
  if (light.map) map_.emplace(light.map);
  map_to_world_ = light.to_world;
  environment_share_ = kPi * mean(light.radiance) * (map_ ? map_->mean_radiance() : 1);
  has_environment_ = environment_share_ > 0;
}

/// By the chord, whose length keeps more digits than the cosine of a small angle: 2 (1 − cos θ) is its square.
bool InfiniteLights::Sun::holds(Vec3 direction) const {
  const Vec3 chord = direction - to_center.z;
  return dot(chord, chord) <= 2 * one_minus_cos;
}

InfiniteLights::Value InfiniteLights::environment(Vec3 normal, Vec3 direction) const {
  if (!has_environment_) return {{}, 0};
  if (map_) {
    const auto found = map_->look_up(times_transposed(map_to_world_, direction));
    return {environment_radiance_ * found.radiance, found.pdf};
  }
  const bool one_side = normal != Vec3{};
  return {environment_radiance_, one_side ? cosine_hemisphere_pdf(dot(normal, direction)) : kUniformSpherePdf};
}

Vec3 InfiniteLights::sample_environment(Vec3 normal, Vec2 u) const {
  if (map_) return times(map_to_world_, map_->sample(u));
  return normal != Vec3{} ? basis_around(normal).to_world(cosine_hemisphere(u)) : uniform_sphere(u);
}

InfiniteLights::Value InfiniteLights::look_up(Vec3 normal, Vec3 direction, const Sun* within) const {
  Value value = environment(normal, direction);
  value.pdf *= environment_share_;
  for (const Sun& sun : suns_) {
    if (&sun != within && !sun.holds(direction)) continue;
    value.radiance = value.radiance + sun.radiance;
    value.pdf += sun.share * uniform_cone_pdf(sun.one_minus_cos);
  }
  return value;
}

std::optional<InfiniteLights::Sample> InfiniteLights::sample(Vec3 normal, double pick, Vec2 u) const {
  const auto from_directional = [](const Directional& light) {
    return Sample{light.direction, light.irradiance, light.share, true};
  };
  const auto toward = [&](Vec3 direction, const Sun* within = nullptr) -> std::optional<Sample> {
    const Vec3 way = unit(direction);
    const Value value = look_up(normal, way, within);
    if (!(value.pdf > 0)) return std::nullopt;
    return Sample{way, value.radiance, value.pdf, false};
  };
  const auto toward_sun = [&](const Sun& sun) {
    return toward(sun.to_center.to_world(uniform_cone(u, sun.one_minus_cos)), &sun);
  };

  for (const Directional& light : directional_) {
    if (pick < light.share) return from_directional(light);
    pick -= light.share;
  }
  for (const Sun& sun : suns_) {
    if (pick < sun.share) {
      u.x = below_one(pick / sun.share);
      return toward_sun(sun);
    }
    pick -= sun.share;
  }
  if (has_environment_) {
    u.x = below_one(pick / environment_share_);
    return toward(sample_environment(normal, u));
  }
  // The shares' rounding has left this pick over.
  return suns_.empty() ? from_directional(directional_.back()) : toward_sun(suns_.back());
}

}  // namespace tessera

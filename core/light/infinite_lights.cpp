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

/// What counts of light that comes from everywhere alike: surfaces' own samples find it about as well.
constexpr double kPartOfEvenLight = 0.25;

/// Cosines are known to less than this.
constexpr double kSlack = 0x1p-10;

/// Of a light around a direction up to an angle by its sine, what comes from above the horizon at most.
InfiniteLights::Sum above_horizon(double irradiance, Vec3 direction, double sine, Vec3 normal) {
  if (normal == Vec3{}) return {irradiance, 1};
  const double cosine = dot(normal, direction) + sine;
  if (cosine < -kSlack) return {};
  return {irradiance * std::clamp(cosine, kSlack, 1.0), 1};
}

/// Of a light that sends `one` among all.
double share(const InfiniteLights::Sum& one, const InfiniteLights::Sum& all) {
  if (!(one.irradiance > 0) || !(all.irradiance > 0)) return 0;
  return 0.5 * one.count / all.count + 0.5 * one.irradiance / all.irradiance;
}

Vec3 unit(Vec3 v) { return UnitVec3::normalize(v).value_or(UnitVec3::z()); }

}  // namespace

InfiniteLights::InfiniteLights(const Scene& scene) {
  for (const Light& light : scene.lights) {
    if (const auto* directional = std::get_if<DirectionalLight>(&light)) add(*directional);
    if (const auto* sun = std::get_if<SunLight>(&light)) add(*sun);
  }
  add(environment_of(scene));
}

InfiniteLights::Sum InfiniteLights::sum_of(const Directional& light, Vec3 normal) {
  return above_horizon(mean(light.irradiance), light.direction, 0, normal);
}
InfiniteLights::Sum InfiniteLights::sum_of(const Sun& sun, Vec3 normal) {
  return above_horizon(sun.irradiance, sun.to_center.z, sun.sine, normal);
}

InfiniteLights::Sum InfiniteLights::sum(Vec3 normal) const {
  Sum all = environment_sum_;
  const auto add = [&](const Sum& one) {
    all.irradiance += one.irradiance;
    all.count += one.count;
  };
  for (const Directional& light : directional_) add(sum_of(light, normal));
  for (const Sun& sun : suns_) add(sum_of(sun, normal));
  return all;
}

void InfiniteLights::add(const DirectionalLight& light) {
  if (!light.irradiance.is_black()) directional_.push_back({-light.direction, light.irradiance});
}

void InfiniteLights::add(const SunLight& light) {
  if (light.angle < kSmallestSun) return add(DirectionalLight{light.direction, light.irradiance});
  if (light.irradiance.is_black()) return;
  const double sine = portable_sin(light.angle / 2.0), half_sine = portable_sin(light.angle / 4.0);
  suns_.push_back({basis_around(-light.direction), static_cast<float>(2 * half_sine * half_sine), sine,
                   light.irradiance * static_cast<float>(1 / (kPi * sine * sine)), mean(light.irradiance)});
}

void InfiniteLights::add(const EnvironmentLight& light) {
  environment_radiance_ = light.radiance;
  if (light.map) map_ = environment_table(light.map);
  map_to_world_ = light.to_world;
  const double irradiance = kPi * mean(light.radiance) * (map_ ? map_->mean_radiance() : 1);
  has_environment_ = irradiance > 0;
  const double part = map_ ? 1 : kPartOfEvenLight;
  if (has_environment_) environment_sum_ = {part * irradiance, part};
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

InfiniteLights::Value InfiniteLights::look_up(Vec3 normal, const Sum& sum, Vec3 direction, const Sun* within) const {
  Value value = environment(normal, direction);
  value.pdf *= share(environment_sum_, sum);
  for (const Sun& sun : suns_) {
    if (&sun != within && !sun.holds(direction)) continue;
    value.radiance = value.radiance + sun.radiance;
    value.pdf += share(sum_of(sun, normal), sum) * uniform_cone_pdf(sun.one_minus_cos);
  }
  return value;
}

std::optional<InfiniteLights::Sample> InfiniteLights::sample(Vec3 normal, const Sum& sum, double pick, Vec2 u) const {
  const auto toward = [&](Vec3 direction, const Sun* within = nullptr) -> std::optional<Sample> {
    const Vec3 way = unit(direction);
    const Value value = look_up(normal, sum, way, within);
    if (!(value.pdf > 0)) return std::nullopt;
    return Sample{way, value.radiance, value.pdf, false};
  };

  for (const Directional& light : directional_) {
    const double its = share(sum_of(light, normal), sum);
    if (pick < its) return Sample{light.direction, light.irradiance, its, true};
    pick -= its;
  }
  for (const Sun& sun : suns_) {
    const double its = share(sum_of(sun, normal), sum);
    if (pick < its) {
      u.x = below_one(pick / its);
      return toward(sun.to_center.to_world(uniform_cone(u, sun.one_minus_cos)), &sun);
    }
    pick -= its;
  }
  // Without an environment this pick is what the shares' rounding has left over.
  if (!has_environment_) return std::nullopt;
  u.x = below_one(pick / share(environment_sum_, sum));
  return toward(sample_environment(normal, u));
}

}  // namespace tessera

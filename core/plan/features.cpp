#include "core/plan/features.h"

#include <algorithm>
#include <variant>

namespace tessera {
namespace {

template <typename... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};

void add(const Surface& surface, Features& to) {
  const auto whitted = whitted_surface(surface);
  to.only_whitted &= whitted.has_value();
  if (whitted) {
    to.reflection |= !whitted->reflect.is_black();
    to.refraction |= !whitted->transmit.is_black();
  }
  std::visit(Overloaded{
                 [&](const WhittedSurface& s) {
                   to.rough_surfaces |= !s.diffuse.is_black() || !s.specular.is_black();
                   to.transmission |= !s.transmit.is_black();
                 },
                 [&](const Diffuse& s) { to.rough_surfaces |= !s.color.is_black(); },
                 [&](const Conductor& s) { to.rough_surfaces |= s.roughness > 0; },
                 [&](const Dielectric& s) {
                   to.rough_surfaces |= s.roughness > 0;
                   to.transmission = true;
                 },
                 [&](const MetallicRoughness&) { to.rough_surfaces = true; },
             },
             surface);
}

void add(const Light& light, Features& to) {
  std::visit(Overloaded{
                 [&](const PointLight& l) {
                   to.shadows = true;
                   to.only_physical &= l.falls_off;
                   to.lights += !l.intensity.is_black();
                 },
                 [&](const DirectionalLight& l) {
                   to.shadows = true;
                   to.lights += !l.irradiance.is_black();
                 },
                 [&](const AmbientLight&) { to.only_physical = false; },
                 [&](const SpotLight& l) {
                   to.only_whitted = false;
                   to.lights += !l.intensity.is_black();
                 },
                 [&](const SunLight& l) {
                   to.only_whitted = false;
                   to.lights += !l.irradiance.is_black();
                   to.sky |= !l.irradiance.is_black();
                   to.even_sky = false;
                 },
                 [&](const EnvironmentLight& l) {
                   to.only_whitted = false;
                   to.even_sky &= l.map == nullptr;
                 },
             },
             light);
}

}  // namespace

Features features_of(const Scene& scene) {
  Features features;
  std::vector<bool> used(scene.materials.size());
  for (const Object& object : scene.objects) {
    used[object.material] = true;
    if (!scene.materials[object.material].emission.is_black())
      features.lights += primitive_count(scene.shapes[object.shape]);
  }
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    const Material& material = scene.materials[i];
    add(material.surface, features);
    features.emitters |= !material.emission.is_black();
    features.alpha |= material.alpha < 1;
  }
  if (features.emitters || features.alpha) features.only_whitted = false;
  for (const Light& light : scene.lights) add(light, features);
  const bool has_environment = !is_black(environment_of(scene));
  features.lights += has_environment;
  features.sky |= has_environment;
  return features;
}

IntegratorKind chosen_integrator(IntegratorKind asked, const Features& features) {
  if (asked != IntegratorKind::automatic) return asked;
  return features.only_whitted ? IntegratorKind::whitted : IntegratorKind::path;
}

bool traces_paths(IntegratorKind integrator) {
  return integrator == IntegratorKind::path || integrator == IntegratorKind::direct;
}

bool is_black(const EnvironmentLight& light) {
  return light.radiance.is_black() || (light.map && std::ranges::all_of(light.map->texels, &Rgb::is_black));
}

EnvironmentLight environment_of(const Scene& scene) {
  for (const Light& light : scene.lights)
    if (const auto* environment = std::get_if<EnvironmentLight>(&light)) return *environment;
  EnvironmentLight background;
  background.radiance = scene.background;
  return background;
}

}  // namespace tessera

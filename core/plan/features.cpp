#include "core/plan/features.h"

#include <algorithm>
#include <variant>

#include "core/light/emissive_surface.h"
#include "core/material/bsdf.h"

namespace tessera {
namespace {

template <typename... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};

void add(const Material& material, Features& to) {
  const auto whitted = whitted_surface(material.surface);
  to.only_whitted &= whitted.has_value();
  if (whitted) {
    to.reflection |= !whitted->reflect.is_black();
    to.refraction |= !whitted->transmit.is_black();
  }
  to.rough_surfaces |= varies(material);  // somewhere, maybe
  for (const bool entering : {true, false}) {
    const Bsdf bsdf = make_bsdf(material.surface, entering);
    to.rough_surfaces |= has_smooth_lobes(bsdf);
    to.transmission |= has_smooth_transmission(bsdf);
  }
}

void add(const Light& light, Features& to) {
  std::visit(Overloaded{
                 [&](const PointLight& l) {
                   to.shadows = true;
                   to.only_physical &= l.falls_off;
                   to.lights += l.falls_off && !l.intensity.is_black();
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
    const Material& material = scene.materials[object.material];
    const Shape& shape = scene.shapes[object.shape];
    if (is_lamp(material) && can_be_sampled(shape)) features.lights += primitive_count(shape);
  }
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    const Material& material = scene.materials[i];
    add(material, features);
    features.emitters |= !material.emission.is_black();
    features.alpha |= has_alpha(material);
    features.textures |= varies(material);
    features.unlit |= std::holds_alternative<Unlit>(material.surface);
    features.absorption |= !material.absorption.is_black() && lets_light_in(material.surface);
  }
  if (features.emitters || features.alpha || features.textures || features.absorption) features.only_whitted = false;
  for (const Light& light : scene.lights) add(light, features);
  features.ground = scene.ground && !scene.objects.empty();
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

}  // namespace tessera

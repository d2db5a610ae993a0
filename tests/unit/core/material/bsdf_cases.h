#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "core/material/bsdf.h"
#include "core/math/vec.h"
#include "core/math/vec2.h"
#include "tests/support/random.h"

namespace tessera {

/// An example of a BSDF, and what the tests may expect of it.
struct BsdfCase {
  std::string name;
  Material material;
  bool entering = true;
  bool is_reciprocal = true;  ///< f(wo, wi) = f(wi, wo); else so but for a factor of wo.
  bool keeps_energy = true;   ///< No more comes back than came.

  Bsdf bsdf() const { return make_bsdf(material.surface, entering); }
};

/// At least one example of every alternative of `Surface`: all that is said of BSDFs in general is tested on these.
inline std::vector<BsdfCase> bsdf_cases() {
  const auto whitted = [](std::string name, const WhittedSurface& s, bool entering = true) {
    return BsdfCase{"whitted, " + name, {.surface = s}, entering, false, false};
  };
  const auto conductor = [](std::string name, const Conductor& s) {
    return BsdfCase{"conductor, " + name, {.surface = s}, true, false};
  };
  const auto dielectric = [](std::string name, const Dielectric& s, bool entering = true) {
    return BsdfCase{"dielectric, " + name, {.surface = s}, entering, false};
  };
  const auto metallic = [](std::string name, const MetallicRoughness& s) {
    return BsdfCase{"metallic_roughness, " + name, {.surface = s}, true, false};
  };
  const auto layered = [](std::string name, const Layered& s, bool entering = true) {
    return BsdfCase{"layered, " + name, {.surface = s}, entering, false};
  };
  const Rgb gold_eta{0.143F, 0.375F, 1.442F}, gold_k{3.983F, 2.386F, 1.603F};
  return {
      whitted("diffuse", {.diffuse = {0.2F, 0.5F, 0.8F}}),
      whitted("all of it", {.diffuse = {0.3F, 0.3F, 0.1F},
                            .specular = {0.5F, 0.5F, 0.5F},
                            .shininess = 20,
                            .reflect = {0.2F, 0.3F, 0.4F},
                            .transmit = {0.7F, 0.6F, 0.5F},
                            .ior = 1.5F,
                            .fresnel = true}),
      whitted("highlight from inside",
              {.diffuse = {}, .specular = {1, 1, 1}, .shininess = 3, .transmit = {1, 1, 1}, .ior = 1.3F}, false),
      {"diffuse", {.surface = Diffuse{{0.9F, 0.5F, 0.1F}}}},
      conductor("smooth", {gold_eta, gold_k}),
      conductor("roughness 0.2", {gold_eta, gold_k, 0.2F}),
      conductor("roughness 0.5", {gold_eta, gold_k, 0.5F}),
      conductor("roughness 1", {gold_eta, gold_k, 1}),
      dielectric("smooth", {}),
      dielectric("smooth, from inside", {.ior = 1.5F, .color = {0.9F, 0.5F, 0.1F}}, false),
      dielectric("roughness 0.25", {.ior = 1.5F, .roughness = 0.25F}),
      dielectric("roughness 0.4, tinted", {.ior = 1.5F, .roughness = 0.4F, .color = {0.9F, 0.5F, 0.1F}}),
      dielectric("roughness 0.4, from inside", {.ior = 1.5F, .roughness = 0.4F}, false),
      dielectric("roughness 1", {.ior = 2.4F, .roughness = 1}),
      dielectric("roughness 1, from inside", {.ior = 1.2F, .roughness = 1}, false),
      dielectric("a bubble in water", {.ior = 0.75F, .roughness = 0.5F}),
      dielectric("black inside", {.ior = 1.5F, .roughness = 0.5F, .color = {}}),
      metallic("smooth coat", {.base_color = {0.8F, 0.3F, 0.2F}, .metallic = 0, .roughness = 0}),
      metallic("plastic", {.base_color = {0.8F, 0.3F, 0.2F}, .metallic = 0, .roughness = 0.3F}),
      metallic("halfway", {.base_color = {0.8F, 0.6F, 0.2F}, .metallic = 0.5F, .roughness = 0.5F}),
      metallic("rough metal", {.base_color = {0.8F, 0.6F, 0.2F}, .metallic = 1, .roughness = 1}),
      {"unlit", {.surface = Unlit{{0.9F, 0.5F, 0.1F}}}},
      layered("plastic of a high index",
              {.base_color = {0.8F, 0.3F, 0.2F}, .metallic = 0, .roughness = 0.3F, .ior = 2.2F}),
      layered("a coloured highlight", {.base_color = {0.8F, 0.3F, 0.2F},
                                       .metallic = 0.2F,
                                       .roughness = 0.4F,
                                       .specular = 0.8F,
                                       .specular_color = {2, 5, 30}}),
      layered("a clear sheet", {.base_color = {0.8F, 0.6F, 0.2F}, .metallic = 0, .roughness = 0, .transmission = 1}),
      layered("a rough sheet", {.base_color = {0.8F, 0.6F, 0.2F},
                                .metallic = 0,
                                .roughness = 0.5F,
                                .specular_color = {1, 0.5F, 0},
                                .transmission = 0.6F}),
      layered("a sheet of a low index",
              {.base_color = {0.8F, 0.6F, 0.2F}, .metallic = 0, .roughness = 0.6F, .ior = 1.2F, .transmission = 1}),
      layered("clear glass",
              {.base_color = {0.8F, 0.6F, 0.2F}, .metallic = 0, .roughness = 0, .transmission = 1, .thin = false}),
      layered("rough glass of another sheen", {.base_color = {0.8F, 0.6F, 0.2F},
                                               .metallic = 0.2F,
                                               .roughness = 0.4F,
                                               .specular = 0.5F,
                                               .specular_color = {0.2F, 3, 1},
                                               .transmission = 0.7F,
                                               .thin = false}),
      layered("rough glass of another sheen, from inside",
              {.base_color = {0.8F, 0.6F, 0.2F},
               .metallic = 0.2F,
               .roughness = 0.4F,
               .specular = 0.5F,
               .specular_color = {0.2F, 3, 1},
               .transmission = 0.7F,
               .thin = false,
               .clearcoat = 1},
              false),
      layered("a lacquered metal",
              {.base_color = {0.8F, 0.6F, 0.2F}, .metallic = 1, .roughness = 0.5F, .clearcoat = 1}),
      layered("a rough lacquer", {.base_color = {0.8F, 0.6F, 0.2F},
                                  .metallic = 0.5F,
                                  .roughness = 0.2F,
                                  .clearcoat = 0.7F,
                                  .clearcoat_roughness = 0.4F}),
      layered("cloth", {.base_color = {0.8F, 0.3F, 0.2F},
                        .metallic = 0,
                        .roughness = 0.8F,
                        .sheen_color = {0.9F, 0.8F, 0.7F},
                        .sheen_roughness = 0.5F}),
      layered("velvet", {.base_color = {0.2F, 0, 0},
                         .metallic = 0,
                         .roughness = 1,
                         .sheen_color = {1, 1, 1},
                         .sheen_roughness = 0.2F}),
      layered("all of it, of glass", {.base_color = {0.9F, 0.8F, 0.7F},
                                      .metallic = 0.1F,
                                      .roughness = 0.5F,
                                      .ior = 1.8F,
                                      .transmission = 0.5F,
                                      .thin = false,
                                      .clearcoat = 0.5F,
                                      .clearcoat_roughness = 0.2F,
                                      .sheen_color = {0.3F, 0.2F, 0.1F},
                                      .sheen_roughness = 0.7F}),
  };
}

/// Of length 1, `cos_theta` from the normal.
inline Vec3 at_angle(double cos_theta, double phi = 0.3) {
  const double sin_theta = std::sqrt((1 - cos_theta) * (1 + cos_theta));
  return to_float(Vec3d{sin_theta * std::cos(phi), sin_theta * std::sin(phi), cos_theta});
}

/// A number between 0 and 1 without either: on the very edge of the square a direction may lie in the horizon.
inline float uniform_float(Random& random) { return (static_cast<float>(random.bits() >> 41) + 0.5F) * 0x1p-23F; }

inline std::optional<BsdfSample> draw(const Bsdf& bsdf, Vec3 wo, Random& random) {
  const float u_lobe = uniform_float(random), x = uniform_float(random), y = uniform_float(random);
  return sample(bsdf, wo, u_lobe, {x, y});
}

}  // namespace tessera

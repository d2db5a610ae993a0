#pragma once

#include <optional>
#include <variant>

#include "core/math/rgb.h"

namespace tessera {

// Surfaces. Reflectances are fractions; indices of refraction are those inside, relative to outside. Roughness is
// perceptual, as in glTF: GGX's α is its square; 0 is perfectly smooth. All reflect on both sides.

/// Whitted's surface (1980) with Phong's highlight. With E the light's irradiance on a plane that faces it, a
/// light adds E/π · (diffuse · cos θ + specular · cos^shininess α), α between the mirrored view direction and the
/// light: classic Phong, as NFF means it, so diffuse + specular may exceed 1. `reflect` and `transmit` weigh the
/// radiance that mirror and refraction rays bring back; black means that no such ray is traced.
struct WhittedSurface {
  Rgb diffuse{0.5F, 0.5F, 0.5F};
  Rgb specular{};
  float shininess = 1;  ///< ≥ 0
  Rgb reflect{};
  Rgb transmit{};
  float ior = 1;         ///< Index of refraction inside, relative to outside; > 0.
  bool fresnel = false;  ///< Split reflect and transmit by Fresnel's equations for dielectrics.
};

/// Lambert's: reflects alike in all directions.
struct Diffuse {
  Rgb color{0.5F, 0.5F, 0.5F};
};

/// A metal, by its complex index of refraction eta + ik in each channel.
struct Conductor {
  Rgb eta, k;  ///< ≥ 0; eta > 0.
  float roughness = 0;
};

/// Glass, water and their kind.
struct Dielectric {
  float ior = 1.5F;  ///< > 0
  float roughness = 0;
  Rgb color{1, 1, 1};  ///< Tints what passes through.
};

/// glTF 2.0's material: a dielectric of index 1.5 over `base_color`, mixed with a metal of that colour by `metallic`.
struct MetallicRoughness {
  Rgb base_color{1, 1, 1};
  float metallic = 1;
  float roughness = 1;
};

using Surface = std::variant<WhittedSurface, Diffuse, Conductor, Dielectric, MetallicRoughness>;

/// What an object is made of.
struct Material {
  Surface surface = Diffuse{};
  Rgb emission{};                 ///< Radiance that it sends out by itself, alike in all directions, W/(sr m²); ≥ 0.
  bool emits_both_sides = false;  ///< Otherwise on the side of the geometric normal alone.
  float alpha = 1;                ///< The share of light that meets it; the rest passes as if it weren't there.
                                  ///< Triangles of one mesh that coincide are one layer.
};

/// The surface as Whitted's: his own, or one that is a special case of it: diffuse, or smooth and dielectric. Nothing
/// for what he has no rays for; emission and alpha aren't looked at.
std::optional<WhittedSurface> whitted_surface(const Surface& surface);

/// Whether it gives nothing back of what comes to it, and lets nothing pass.
bool is_black(const Surface& surface);

}  // namespace tessera

#pragma once

#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

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

/// `MetallicRoughness` with what glTF's extensions put in it and on it: KHR_materials_ior, _specular, _transmission,
/// _volume (whose absorption is the `Material`'s), _sheen, and above all that _clearcoat.
struct Layered {
  Rgb base_color{1, 1, 1};
  float metallic = 1;
  float roughness = 1;
  float ior = 1.5F;    ///< Of the dielectric; > 0, or 0 for one that is infinite: then it reflects all but for tints.
  float specular = 1;  ///< Weighs what the dielectric reflects.
  Rgb specular_color{1, 1, 1};  ///< Tints it, least along the surface; ≥ 0, may exceed 1.
  float transmission = 0;       ///< The share of what the dielectric doesn't reflect that passes, tinted by base_color.
  bool thin = true;             ///< It passes straight, as through a sheet; else it is refracted, as into glass.
  float clearcoat = 0;          ///< How much of the surface a coat of index 1.5 covers.
  float clearcoat_roughness = 0;
  Rgb sheen_color{};  ///< Of the fibres of cloth; black: there are none.
  float sheen_roughness = 0;
};

/// Shows its colour as radiance to whoever looks, on both sides, whatever the light. It isn't a lamp: none is sampled
/// there.
struct Unlit {
  Rgb color{1, 1, 1};
};

using Surface = std::variant<WhittedSurface, Diffuse, Conductor, Dielectric, MetallicRoughness, Layered, Unlit>;

/// What a texture says something of. Those that a surface doesn't have are ignored.
enum class TextureSlot : std::uint8_t {
  base_color,  ///< Or the colour of `Diffuse` and `Dielectric`, or `WhittedSurface::diffuse`.
  emission,
  alpha,
  metallic,
  roughness,
  normal,  ///< In the tangent frame, from 0..1 as -1..1.
  bump,    ///< A height in units of the mesh.
  specular,
  specular_color,  ///< Or `WhittedSurface::specular` and `reflect`.
  transmission,
  clearcoat,
  clearcoat_roughness,
  sheen_color,
  sheen_roughness,
  glossiness  ///< Of `Layered`: what its roughness lacks of 1 is multiplied by it.
};

/// What the texture says, times the material's own number: but for normals and heights, which have none.
struct TextureUse {
  TextureSlot slot;
  std::uint32_t texture = 0;  ///< Into `Scene::textures`.
  std::uint8_t channel = 0;   ///< Of what is a single number; 3 is alpha, 1 where the image has none.
  float scale = 1;            ///< Of normals, along the surface, and of heights.
};

/// What an object is made of.
struct Material {
  Surface surface = Diffuse{};
  Rgb emission{};                 ///< Radiance that it sends out by itself, alike in all directions, W/(sr m²); ≥ 0.
  bool emits_both_sides = false;  ///< Otherwise on the side of the geometric normal alone.
  float alpha = 1;                ///< The share of light that meets it; the rest passes as if it weren't there.
                                  ///< Triangles of one mesh that coincide are one layer.
  float alpha_cutoff = 0;         ///< Where it is above 0, alpha counts as 1 from there on, and as 0 below.
  bool has_vertex_colors = false;  ///< Its colour is multiplied by that of a mesh's vertices,
  bool has_vertex_alpha = false;   ///< and its alpha by theirs.
  std::vector<TextureUse> textures = {};
  Rgb absorption{};  ///< Of what `lets_light_in`: Beer's law, what light loses per metre inside, 1/m; ≥ 0.
};

/// Whether the material isn't the same all over: see core/material/surface_at.h.
inline bool varies(const Material& material) { return material.has_vertex_colors || !material.textures.empty(); }

bool has_texture(const Material& material, TextureSlot slot);

/// Whether its alpha isn't the same all over.
bool alpha_varies(const Material& material);

/// Whether some of it may let light pass as if it weren't there.
bool has_alpha(const Material& material);

/// Whether it sends out light that can be sampled: all of it is there, or the same share everywhere.
bool is_lamp(const Material& material);

/// The surface as Whitted's: his own, or one that is a special case of it: diffuse, or smooth and dielectric. Nothing
/// for what he has no rays for; emission and alpha aren't looked at.
std::optional<WhittedSurface> whitted_surface(const Surface& surface);

/// The colour that it is made of, as it stands in the material: that of a conductor is what it reflects straight back.
Rgb base_color(const Surface& surface);

/// Whether light that passes it is inside then: it isn't a sheet.
bool lets_light_in(const Surface& surface);

/// Whether it gives nothing back of what comes to it, and lets nothing pass.
bool is_black(const Surface& surface);

}  // namespace tessera

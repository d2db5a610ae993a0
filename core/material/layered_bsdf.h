#pragma once

#include <optional>

#include "core/material/bsdf_sample.h"
#include "core/material/dielectric_bsdf.h"
#include "core/math/vec2.h"
#include "core/scene/material.h"

namespace tessera {

/// glTF's material with its extensions, as their texts have it, and where they leave it open as `MetallicRoughnessBsdf`
/// does: it is the same where they are at their defaults. From below: the base, a mix of a metal and of a dielectric,
/// in which light is scattered, passes a sheet (the highlight's lobe behind the surface, but less rough where the index
/// is below 1.5) or enters glass; the sheen, which takes from the base what it sends back itself; the coat, which
/// reflects by its Fresnel term of wo alone, so that what it doesn't reflect reaches all beneath.
///
/// No more comes back than came, and all of it if all is white and there is no sheen. Reciprocal but for factors of wo:
/// Turquin's scales, and the coat's.
struct LayeredBsdf {
  Rgb base_color;
  float roughness;  ///< As `effective_roughness` gives it, as are the others.
  float metal;      ///< Shares of the base: the metal's,
  float coated;     ///< the dielectric's whose highlight has Schlick's term: all but the glass,
  float diffuse;    ///< of that what scatters,
  float sheet;      ///< and what passes straight;
  float glass;      ///< and the glass.
  Rgb f0;           ///< The dielectric's reflectance at normal incidence, before `specular`.
  float specular;
  float base_mean;  ///< What the highlight lets pass of even light.
  float sheet_roughness;
  DielectricBsdf glass_bsdf;
  bool tints_glass;  ///< `specular` and its colour change what the glass reflects.
  Rgb sheen_color;
  float sheen_roughness;
  float clearcoat;
  float clearcoat_roughness;

  BsdfValue evaluate(Vec3 wo, Vec3 wi) const;
  std::optional<BsdfSample> sample(Vec3 wo, float u_lobe, Vec2 u) const;
  bool has_smooth_lobes() const;
  bool has_smooth_transmission() const;
  bool has_one_lobe() const { return false; }
  Rgb albedo(Vec3 wo) const;
};

LayeredBsdf bsdf_of(const Layered& surface, bool entering);

}  // namespace tessera

#pragma once

#include <optional>
#include <variant>

#include "core/material/bsdf_sample.h"
#include "core/material/conductor_bsdf.h"
#include "core/material/dielectric_bsdf.h"
#include "core/material/diffuse_bsdf.h"
#include "core/material/layered_bsdf.h"
#include "core/material/metallic_roughness_bsdf.h"
#include "core/material/unlit_bsdf.h"
#include "core/material/whitted_bsdf.h"
#include "core/math/vec2.h"
#include "core/scene/material.h"

namespace tessera {

/// How a surface scatters light at a hit: plain numbers, one alternative for each of `Surface`. Directions are unit and
/// leave the surface, in the frame whose z is the shading normal on the viewer's side; so wo has z > 0, and wi with z <
/// 0 has passed the surface. Radiance is transported, from wi to wo. No direction, however close to the horizon, gives
/// NaN, infinity or less than 0. All functions are pure and the same on every machine.
///
/// To add a material: (1) its parameters become a struct in core/scene/material.h, listed in `Surface`;
/// `whitted_surface` and `is_black` there say whether it may be one of Whitted's, and black; (2) a file here gets its
/// BSDF, a struct with the members that the functions below call (diffuse_bsdf.h is the shortest example), and
/// `bsdf_of`, which makes it; (3) it is listed in `Bsdf`; (4) tests/unit/core/material/bsdf_cases.h lists examples of
/// it, on which every test of BSDFs runs; (5) proto/read_material.cpp gives it a name on the wire.
using Bsdf = std::variant<WhittedBsdf, DiffuseBsdf, ConductorBsdf, DielectricBsdf, MetallicRoughnessBsdf, LayeredBsdf,
                          UnlitBsdf>;

/// `entering`: the viewer is outside, where the geometric normal points.
inline Bsdf make_bsdf(const Surface& of, bool entering) {
  return std::visit([&](const auto& surface) -> Bsdf { return bsdf_of(surface, entering); }, of);
}

/// What goes from wi to wo, delta lobes apart. Black where wo.z ≤ 0.
inline BsdfValue evaluate(const Bsdf& bsdf, Vec3 wo, Vec3 wi) {
  return std::visit([&](const auto& b) { return b.evaluate(wo, wi); }, bsdf);
}

/// A direction for light to come from, about as probable as what comes from there counts. `u_lobe` and `u` are in [0,
/// 1). Nothing where the light is lost: what is drawn is below the horizon, the surface is black, or wo.z ≤ 0.
inline std::optional<BsdfSample> sample(const Bsdf& bsdf, Vec3 wo, float u_lobe, Vec2 u) {
  return std::visit([&](const auto& b) { return b.sample(wo, u_lobe, u); }, bsdf);
}

/// Whether `evaluate` can give anything but black.
inline bool has_smooth_lobes(const Bsdf& bsdf) {
  return std::visit([](const auto& b) { return b.has_smooth_lobes(); }, bsdf);
}

/// Whether it can for a wi on the other side, so that light from behind counts.
inline bool has_smooth_transmission(const Bsdf& bsdf) {
  return std::visit([](const auto& b) { return b.has_smooth_transmission(); }, bsdf);
}

/// Whether `sample` doesn't read `u_lobe`.
inline bool has_one_lobe(const Bsdf& bsdf) {
  return std::visit([](const auto& b) { return b.has_one_lobe(); }, bsdf);
}

/// About what comes back to wo of even light from everywhere, reflected or passed, without the scaling by 1/eta²; in
/// 0..1. What is unlit tells its colour.
inline Rgb albedo(const Bsdf& bsdf, Vec3 wo) {
  return std::visit([&](const auto& b) { return b.albedo(wo); }, bsdf);
}

}  // namespace tessera

#pragma once

#include <cstdint>

#include "core/scene/scene.h"
#include "core/scene/settings.h"

namespace tessera {

/// What a scene has, of what costs something to render: settled once, in the plan. What isn't there is skipped.
/// Materials count if an object has them.
struct Features {
  bool only_whitted = true;   ///< All surfaces and lights are Whitted's, or special cases of his; none emits.
  bool only_physical = true;  ///< No light is ambient or without falloff: those have a meaning in `whitted` alone.

  bool shadows = false;     ///< A light that something can hide.
  bool reflection = false;  ///< A surface that asks Whitted's tracer for mirrored rays,
  bool refraction = false;  ///< or for refracted ones.

  bool emitters = false;        ///< An object emits.
  std::uint64_t lights = 0;     ///< That `LightTable` may sample: primitives that emit, and lights that aren't black.
  bool sky = false;             ///< What rays see that hit nothing isn't black: the environment, or a sun.
  bool even_sky = true;         ///< It is the same in all directions.
  bool rough_surfaces = false;  ///< A surface with smooth lobes: lights are sampled there.
  bool transmission = false;    ///< A surface whose smooth lobes pass light.
  bool alpha = false;           ///< A surface that isn't all there.
  bool ground = false;          ///< A ground, and something that may hide the sky from it.
  bool unlit = false;           ///< A surface shows its colour, whatever the light.
  bool absorption = false;      ///< A surface that lets light into what absorbs it.
  bool textures = false;        ///< A surface that isn't the same all over.
};
Features features_of(const Scene& scene);

/// The integrator that renders a scene with these features when `asked` is asked for: never `automatic`.
IntegratorKind chosen_integrator(IntegratorKind asked, const Features& features);

/// Whether it is `path`, or `path` with short chains: what knows all lights.
bool traces_paths(IntegratorKind integrator);

/// Rays in a chain of `IntegratorKind::direct`: to what is seen, and from there to a light.
inline constexpr std::uint32_t kDirectDepth = 2;

}  // namespace tessera

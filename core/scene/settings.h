#pragma once

#include <cstdint>
#include <set>

#include "core/scene/accel_options.h"

namespace tessera {

/// Whether first-level rays may use the areas that objects project to: object by object, or in a hierarchy that also
/// knows the parts of large meshes.
enum class ScreenBounds { off, flat, hierarchical };

/// What a film records beside colour; what each is, and how its values come about, says core/film/aov_table.h.
enum class Aov {
  depth,
  normal,
  primitive_id,
  object_id,
  cost_volumes,
  cost_primitives,
  albedo,
  position,
  alpha,
  sample_count,
  variance
};

/// Side of the square tiles in pixels; 0 lets the plan size tiles by what projects into them.
inline constexpr std::uint32_t kAdaptiveTiles = 0;

/// How a scene is rendered. Only image size, `samples`, `jitter`, `max_depth` and `seed` influence pixels;
/// the rest says how to get there.
struct Settings {
  std::uint32_t width = 512;
  std::uint32_t height = 512;
  std::uint32_t samples = 1;  ///< Per pixel; ≥ 1.
  bool jitter = true;         ///< Samples fall anywhere in the pixel; otherwise all on its centre.
  /// Rays in a chain, the camera's being the first; ≥ 1. A chain ends earlier where what the next ray brings would be
  /// weighed with less than 2^-25, and a camera ray leads to 4096 others at most (`Whitted`).
  std::uint32_t max_depth = 5;
  std::uint64_t seed = 0;
  AccelOptions accel;
  ScreenBounds screen_bounds = ScreenBounds::flat;
  std::uint32_t tile_size = kAdaptiveTiles;
  std::set<Aov> aovs;
  bool count_tests = false;  ///< Count what `TestCounts` holds; the cost planes count in any case.
};

}  // namespace tessera

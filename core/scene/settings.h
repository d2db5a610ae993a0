#pragma once

#include <cstdint>
#include <optional>
#include <set>

#include "core/math/rounding.h"
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
  variance,
  base_color
};

/// How light is followed. `automatic` is `whitted` where a scene has nothing but Whitted's materials and lights, and
/// `path` otherwise. `direct` is `path` with two rays in a chain at most. `none` follows none: what is seen is black,
/// and AOVs are all there is.
enum class IntegratorKind { automatic, whitted, direct, ambient_occlusion, path, none };

/// Where the numbers of samples come from. `automatic` is `grid` (jittered cells of the pixel, as many as there are
/// samples) for `whitted`, which alone takes it, where all of them will be used, and `sobol` otherwise.
enum class SamplerKind { automatic, grid, independent, sobol };

/// What a pixel's samples are spread by.
enum class FilterKind { box, gaussian, blackman_harris };

/// Side of the square tiles in pixels; 0 lets the plan size tiles by what projects into them.
inline constexpr std::uint32_t kAdaptiveTiles = 0;

/// How a scene is rendered. The structure, screen bounds, tile size, AOVs and whether tests are counted don't influence
/// colours; they say how to get there.
struct Settings {
  std::uint32_t width = 512;
  std::uint32_t height = 512;
  std::uint32_t samples = 1;  ///< Per pixel, at most; ≥ 1.
  /// Where given, no more samples are spent once the image's error (the square root of relMSE: the mean of
  /// (I − R)² / (R² + 0.01) over pixels and channels) is at most this; > 0.
  std::optional<float> error;
  std::optional<double> seconds;  ///< Where given, no pass begins that would end later; > 0.
  bool adaptive = true;           ///< With either: samples go where there is error left, block by block.
  bool jitter = true;             ///< Samples fall anywhere in the pixel; otherwise all on its centre.
  /// ≥ 1; where none is given, as many as suit the integrator. For `whitted`, rays in a chain, the camera's being the
  /// first. A chain ends earlier where what the next ray brings would be weighed with less than 2^-25, and a camera ray
  /// leads to 4096 others at most (`Whitted`). For `path`, segments of a path from the camera to a light, as Mitsuba
  /// counts them: at 1 emitters are seen, at 2 surfaces that they light.
  std::optional<std::uint32_t> max_depth;
  std::uint64_t seed = 0;
  IntegratorKind integrator = IntegratorKind::automatic;
  SamplerKind sampler = SamplerKind::automatic;
  FilterKind filter = FilterKind::box;
  float filter_width = 0;                     ///< In pixels; 0: as wide as its kind is by default.
  float clamp = kInfinity;                    ///< No sample is brighter than this in any channel; > 0.
  float ambient_occlusion_reach = kInfinity;  ///< Metres that `ambient_occlusion` looks; > 0.
  bool transparent = false;                   ///< Where nothing is hit, the image is black, and its alpha 0.
  AccelOptions accel;
  ScreenBounds screen_bounds = ScreenBounds::flat;
  std::uint32_t tile_size = kAdaptiveTiles;
  std::set<Aov> aovs;
  bool count_tests = false;  ///< Count what `TestCounts` holds; the cost planes count in any case.
};

/// Whether a job's samples are two independent replicates, so that its error can be told: sample i belongs to replicate
/// i % 2. Otherwise they are one.
inline bool measures_error(const Settings& settings) { return settings.error || settings.seconds; }

}  // namespace tessera

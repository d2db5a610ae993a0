#pragma once

#include <cstdint>
#include <set>

namespace tessera {

/// Which acceleration structure a job asks for. `automatic` lets the plan pick.
enum class AccelKind { automatic, brute, bvh };

/// Whether first-level rays may use the objects' projected screen areas.
enum class ScreenBounds { off, flat };

/// What a film records beside colour, from the first sample of each pixel.
enum class Aov { depth, normal, primitive_id, object_id };

/// Side of the square tiles in pixels; 0 lets the plan size tiles by what projects into them.
inline constexpr std::uint32_t kAdaptiveTiles = 0;

/// How a scene is rendered. Only image size, `samples`, `jitter`, `max_depth` and `seed` influence pixels;
/// the rest says how to get there.
struct Settings {
  std::uint32_t width = 512;
  std::uint32_t height = 512;
  std::uint32_t samples = 1;    ///< Per pixel; ≥ 1.
  bool jitter = true;           ///< Samples fall anywhere in the pixel; otherwise all on its centre.
  std::uint32_t max_depth = 5;  ///< Rays in a chain, the camera's being the first; ≥ 1.
  std::uint64_t seed = 0;
  AccelKind accel = AccelKind::automatic;
  ScreenBounds screen_bounds = ScreenBounds::flat;
  std::uint32_t tile_size = kAdaptiveTiles;
  std::set<Aov> aovs;
};

}  // namespace tessera

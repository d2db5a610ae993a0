#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/bounds/pixel_rect.h"
#include "core/scene/scene.h"
#include "core/scene/settings.h"

namespace tessera {

/// A rectangle of pixels that one thread renders in one go, and the objects that project into it.
struct Tile {
  PixelRect rect;
  std::uint32_t first_candidate = 0;  ///< Into `Plan::candidates`.
  std::uint32_t candidate_count = 0;  ///< 0 with screen bounds on: only background.
};

/// How first-level rays of a tile search.
enum class FirstLevel { structure, candidates };

/// Something that the plan leaves out because the scene doesn't need it.
struct Skip {
  std::string what;     ///< A stable name, e.g. "shadow_rays".
  std::string because;  ///< A sentence.
  std::uint64_t count;  ///< How many are left out; what is counted is said in `because`.
};

/// What will be done to render a scene, and why: a pure function of scene, camera and settings.
struct Plan {
  AccelKind accel = AccelKind::brute;  ///< Never `automatic`.
  std::string accel_because;
  std::uint64_t primitives = 0;
  std::uint64_t objects_on_screen = 0;  ///< Whose projected area isn't empty; all, with screen bounds off.
  std::vector<Tile> tiles;              ///< Disjoint, together the whole image; in the order of rendering.
  std::vector<std::uint32_t> candidates;
  std::vector<Skip> skips;
};

Plan make_plan(const Scene& scene, const Camera& camera, const Settings& settings);

}  // namespace tessera

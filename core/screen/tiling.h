#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/bounds/pixel_rect.h"
#include "core/scene/scene.h"
#include "core/scene/settings.h"

namespace tessera {

/// How the first-level rays of a tile search.
enum class FirstLevel {
  nothing,     ///< Nothing projects into the tile: its pixels are background and no ray is traced.
  candidates,  ///< The few objects that project into it, one by one.
  structure,   ///< The whole structure.
};

/// A rectangle of pixels that one thread renders in one go.
struct Tile {
  PixelRect rect;
  FirstLevel first_level = FirstLevel::structure;
  std::uint32_t first_candidate = 0;  ///< Into `Tiling::candidates`; used by `FirstLevel::candidates` alone.
  std::uint32_t candidate_count = 0;
};

/// An image cut into tiles.
struct Tiling {
  std::vector<Tile> tiles;  ///< Disjoint, together the whole image; neighbours mostly follow each other.
  std::vector<std::uint32_t> candidates;
  std::uint64_t objects_on_screen = 0;  ///< Whose projected area isn't empty; all, with screen bounds off.

  std::span<const std::uint32_t> candidates_of(const Tile& tile) const {
    return std::span(candidates).subspan(tile.first_candidate, tile.candidate_count);
  }
};

/// Cuts the image by the areas that the scene's objects, or their parts (`ScreenBounds`), project to. With a tile size
/// set, tiles are squares of that size; otherwise the image is halved until a tile is empty, or cheap enough for its
/// few candidates and pixels.
Tiling make_tiling(const Scene& scene, const Camera& camera, const Settings& settings);

}  // namespace tessera

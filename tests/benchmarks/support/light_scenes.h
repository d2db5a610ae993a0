#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/support/float_image.h"

namespace tessera::bench {

/// A scene for the path tracer and for its peer: a document of ours whose meshes are binary PLY files.
struct LightScene {
  std::string name, what;
  nlohmann::json document;  ///< Paths are from the folder that the scenes were written to.
  std::uint32_t max_depth = 0;
  std::optional<FloatImage> known;  ///< What is known of its image without us, of kLightSide pixels each way.
};

inline constexpr std::uint32_t kLightSide = 128;

/// Writes the scenes' meshes to `folder`. Scenes that need data beside the checkout are left out where it is missing,
/// with a line that says so. Mitsuba's eight references; two furnaces, whose images are known in closed form; a product
/// shot, the kitchen, and a room with 1200 lamps.
std::vector<LightScene> light_scenes(const std::filesystem::path& folder);

/// The room with one quad above it, or with that quad cut into `triangles` pieces of various sizes and powers that
/// hang over all of the room.
LightScene lamp_scene(const std::filesystem::path& folder, std::uint32_t triangles);

/// The organic body of 100,000 triangles under a square lamp.
LightScene organic_scene(const std::filesystem::path& folder);

/// A glass ball on a floor under a small lamp: its light comes to a point there by paths that are seldom found.
LightScene caustic_scene();

}  // namespace tessera::bench

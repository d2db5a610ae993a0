#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace tessera::proto {

// The documents that make a picture of a model's file that comes by itself. Whoever writes them, it is the same
// picture.

/// What may be said of a model; the rest is as a shop would have it on its page. What isn't given is left to that, or
/// to the file, which may be a scene of its own.
struct ModelLook {
  bool is_a_scene = false;            ///< The file says how it is seen and lit, as NFF does.
  std::optional<std::string> camera;  ///< One of the file's, by index or name.
  std::optional<std::string> variant;
  std::optional<double> smooth;  ///< Degrees.
  nlohmann::json environment;    ///< A light in place of the studio, which lights what brings none; null for that.
  bool has_z_up = false;
  bool has_ground = true;
};

/// The scene around `file`, an object of the type "file".
nlohmann::json model_scene(const ModelLook& look, nlohmann::json file);

/// The light that is asked for by "studio", the hash of an image, or radiance as one number or three ("0.5",
/// "1,0.9,0.8"); nothing for other text.
std::optional<nlohmann::json> environment_light(std::string_view asked);

/// From where the server looks at what it frames, in degrees.
struct ViewAngles {
  std::optional<double> azimuth, elevation, fov;

  bool is_given() const { return azimuth || elevation || fov; }
};
nlohmann::json view_camera(const ViewAngles& angles);

/// One side alone is both; with neither, it is a picture's usual size.
nlohmann::json picture_size(std::optional<std::uint32_t> width, std::optional<std::uint32_t> height);

/// When to stop: with nothing given, as soon as it is clean.
struct PictureEnd {
  std::optional<std::uint64_t> samples;
  std::optional<double> error, seconds;
};
nlohmann::json picture_until(const PictureEnd& end);

/// How such a picture is shown, in formats for display.
inline constexpr std::string_view kPictureToneMap = "khronos_pbr_neutral", kPictureBackground = "white";

}  // namespace tessera::proto

#include "proto/wire/model_picture.h"

#include <algorithm>
#include <utility>

#include "proto/wire/sha256.h"

namespace tessera::proto {
namespace {

using nlohmann::json;

constexpr std::uint32_t kDefaultSide = 512;
constexpr double kDefaultError = 0.02;
constexpr std::uint32_t kDefaultSamples = 256;
/// Three quarters from the front, which is +z, and a little from above.
constexpr double kAzimuth = 30, kElevation = 20;
/// As narrow as products are photographed.
constexpr double kFieldOfView = 30;
constexpr double kLargestLight = 1e18;  ///< As documents may have it.

json studio_light() { return {{"type", "environment"}, {"preset", "studio"}}; }

}  // namespace

json model_scene(const ModelLook& look, json file) {
  if (look.camera) {
    const json index = json::parse(*look.camera, nullptr, false);
    file["file_camera"] = index.is_number_unsigned() ? index : json(*look.camera);
  }
  if (look.variant) file["variant"] = *look.variant;
  if (look.smooth) file["smooth"] = *look.smooth;
  if (look.has_z_up) file["transform"] = {1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0};
  json scene{{"objects", json::array({std::move(file)})}};
  if (!look.environment.is_null()) {
    scene["lights"] = json::array({look.environment});
  } else if (!look.is_a_scene) {
    json light = studio_light();
    light["only_without_lights"] = true;
    scene["lights"] = json::array({std::move(light)});
  }
  if (look.has_ground && !look.is_a_scene) scene["ground"] = "shadow";
  return scene;
}

std::optional<json> environment_light(std::string_view asked) {
  if (asked == "studio") return studio_light();
  if (is_content_hash(asked)) return json{{"type", "environment"}, {"blob", asked}};
  json radiance = json::parse('[' + std::string(asked) + ']', nullptr, false);
  if (radiance.is_array() && radiance.size() == 1) radiance = {radiance[0], radiance[0], radiance[0]};
  const auto is_light = [](const json& value) { return value.is_number() && value >= 0 && value <= kLargestLight; };
  if (!radiance.is_array() || radiance.size() != 3 || !std::ranges::all_of(radiance, is_light)) return std::nullopt;
  return json{{"type", "environment"}, {"radiance", std::move(radiance)}};
}

json view_camera(const ViewAngles& angles) {
  return {{"type", "perspective"},
          {"azimuth", angles.azimuth.value_or(kAzimuth)},
          {"elevation", angles.elevation.value_or(kElevation)},
          {"fov", angles.fov.value_or(kFieldOfView)}};
}

json picture_size(std::optional<std::uint32_t> width, std::optional<std::uint32_t> height) {
  const std::uint32_t side = width.value_or(height.value_or(kDefaultSide));
  return {{"width", width.value_or(side)}, {"height", height.value_or(side)}};
}

json picture_until(const PictureEnd& end) {
  if (!end.samples && !end.error && !end.seconds) return {{"error", kDefaultError}, {"samples", kDefaultSamples}};
  json until = json::object();
  if (end.samples) until["samples"] = *end.samples;
  if (end.error) until["error"] = *end.error;
  if (end.seconds) until["seconds"] = *end.seconds;
  return until;
}

}  // namespace tessera::proto

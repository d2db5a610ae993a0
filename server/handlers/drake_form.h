#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "core/io/image_io.h"
#include "core/scene/camera.h"
#include "proto/wire/result.h"
#include "proto/wire/sha256.h"
#include "server/http/request.h"

namespace tessera::server {

enum class DrakeImage { color, depth, label };

/// What a client of Drake's asks for: "glTF Render Client-Server API" in Drake's documentation, whose names of fields
/// these are. `fov_x` and `fov_y` say what `focal_x` and `focal_y` do, and `submit` nothing.
struct DrakeForm {
  std::string_view scene;  ///< A glTF file, as it lies in the body.
  proto::ContentHash scene_sha256;
  DrakeImage image_type = DrakeImage::color;
  std::uint32_t width = 0, height = 0;
  Clipping clipping;
  Intrinsics intrinsics;
  DepthSensor sensor;         ///< Of depth alone.
  std::uint32_t samples = 1;  ///< Of colour: by the query.
  ImageFormat format = ImageFormat::png;
};

/// Query parameters of POST /render, none of which Drake sends.
std::vector<std::string_view> drake_query_names();

/// Reads the form in the body of a request. `malformed_request` with the names of all fields that are missing, unknown,
/// given twice or make no sense.
proto::Result<DrakeForm> read_drake_form(const Request& request, std::string_view body);

}  // namespace tessera::server

#pragma once

#include "core/scene/camera.h"
#include "proto/json_cursor.h"

namespace tessera::proto {

/// A camera, by the rules of the readers in json_cursor.h; nothing when it won't do. Degrees on the wire.
std::optional<Camera> read_camera(JsonCursor value);

}  // namespace tessera::proto

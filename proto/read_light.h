#pragma once

#include "core/scene/light.h"
#include "proto/json_cursor.h"

namespace tessera::proto {

/// A light, by the rules of the readers in json_cursor.h; nothing when its type is unknown.
std::optional<Light> read_light(JsonCursor value);

}  // namespace tessera::proto

#pragma once

#include "core/scene/light.h"
#include "proto/file_loader.h"
#include "proto/json_cursor.h"

namespace tessera::proto {

struct ReadLight {
  Light light;
  bool only_without_lights = false;  ///< It is to be left out where there are lights without this.
};

/// A light, by the rules of the readers in json_cursor.h; nothing when its type is unknown. An environment's map comes
/// from `files`. Degrees on the wire.
std::optional<ReadLight> read_light(JsonCursor value, FileLoader& files);

}  // namespace tessera::proto

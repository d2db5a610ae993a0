#pragma once

#include "core/math/transform.h"
#include "proto/json_cursor.h"

namespace tessera::proto {

/// A placement: 12 or 16 numbers row-major, or {"translate", "rotate", "scale"} in any combination, applied scale
/// first, then rotate, then translate. By the rules of the readers in json_cursor.h; nothing when it won't do, or
/// when it is singular.
std::optional<Transform> read_transform(JsonCursor value);

}  // namespace tessera::proto

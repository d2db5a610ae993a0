#pragma once

#include "core/scene/material.h"
#include "proto/json_cursor.h"

namespace tessera::proto {

/// A material, by the rules of the readers in json_cursor.h; nothing when its type is unknown.
///
/// phong, mirror and whitted are Whitted's surface, with the fields that they name; the others have surfaces of their
/// own. A conductor is given by its index of refraction, by the colour that it reflects at normal incidence, or as one
/// of a few metals. "emission", "emits" and "alpha" may stand in any.
std::optional<Material> read_material(JsonCursor value);

}  // namespace tessera::proto

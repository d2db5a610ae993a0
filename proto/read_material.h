#pragma once

#include "core/scene/material.h"
#include "proto/json_cursor.h"

namespace tessera::proto {

/// A material, by the rules of the readers in json_cursor.h; nothing when its type is unknown.
///
/// diffuse, phong and mirror fill the fields of core's material that they name. dielectric is clear glass by
/// Fresnel's equations: it reflects without colour, and its colour tints what passes. whitted is core's material,
/// field by field.
std::optional<Material> read_material(JsonCursor value);

}  // namespace tessera::proto

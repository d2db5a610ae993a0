#pragma once

#include "core/math/rgb.h"
#include "core/math/unit_vec3.h"
#include "proto/json_cursor.h"

namespace tessera::proto {

/// Within ±kLargestCoordinate, so that no square of a length overflows.
extern const NumberRange kCoordinate;

/// Of a light's or an emitter's channel: from 0 to kLargestLight.
extern const NumberRange kLightChannel;

// Readers of small vectors, by the rules of the readers in json_cursor.h.
bool read(std::optional<JsonCursor> value, Vec3& out, const NumberRange& range);
bool read_color(std::optional<JsonCursor> value, Rgb& out, const NumberRange& range);

/// Degrees on the wire, radians in core: rounded once.
float radians(float degrees);

/// The name of a schema that editors find at the top of a document, and that says nothing to us: any string.
bool read_schema_name(std::optional<JsonCursor> value);

/// Any length but zero.
bool read_direction(std::optional<JsonCursor> value, UnitVec3& out);

}  // namespace tessera::proto

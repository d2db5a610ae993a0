#pragma once

#include "core/geometry/shape.h"
#include "proto/json_cursor.h"

namespace tessera::proto {

/// What can stand as an object's "type".
enum class ShapeType { mesh, sphere, cylinder, cone, disk, quad, file, instance };

/// A shape that the document itself spells out.
struct InlineShape {
  Shape shape;
  DroppedTriangles dropped;  ///< What a mesh lost.
};

/// Reads the fields of a shape that is neither a file nor an instance, by the rules of the readers in
/// json_cursor.h; nothing when it won't do. Leaves the check for unknown fields to the caller, who may know more.
std::optional<InlineShape> read_inline_shape(ShapeType type, JsonFields& fields);

}  // namespace tessera::proto

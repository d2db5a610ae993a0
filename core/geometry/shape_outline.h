#pragma once

#include "core/bounds/outline.h"
#include "core/geometry/shape.h"

namespace tessera {

/// What the shape's surface is the convex hull of, or lies within: what bounding volumes are fitted to. A mesh has the
/// vertices that its triangles use, each once; round shapes have ellipsoids. Empty for a mesh without triangles.
Outline outline(const Shape& shape);

}  // namespace tessera

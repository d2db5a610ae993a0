#pragma once

#include <cstdint>
#include <span>

#include "core/accel/wide/wide_tree.h"
#include "core/bounds/aabb.h"
#include "core/geometry/triangle_mesh.h"

namespace tessera {

/// A node around one to eight boxes, with the orders in which rays meet them; what its children are is left to the
/// caller, and starts as none. Precondition: no box is empty, and coordinates are those of a mesh.
WideNode make_wide_node(std::span<const Aabb> boxes);

/// Writes a leaf of these triangles (one to eight) at `words`; returns how many it took: `leaf_words`.
std::uint32_t write_leaf(const TriangleMesh& mesh, std::span<const std::uint32_t> triangles, std::uint32_t* words);

}  // namespace tessera

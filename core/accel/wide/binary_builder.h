#pragma once

#include <cstdint>

#include "core/accel/wide/binary_tree.h"
#include "core/accel/wide/raw_array.h"
#include "core/accel/wide/wide_build.h"
#include "core/geometry/triangle_mesh.h"

namespace tessera {

/// The binary tree over a mesh, with the plan of its collapse: node 0 is the root; leaves show stretches of
/// `triangles`.
struct BinaryTree {
  RawArray<BinaryNode> nodes;
  RawArray<std::uint32_t> triangles;
};

/// Built top-down by binned SAH, of at most `WideTree::kMostDepth` levels, with leaves of at most `leaf_size`. The same
/// tree for any number of threads. Precondition: the mesh is valid, and has triangles; `options.threads` ≥ 1.
BinaryTree build_binary(const TriangleMesh& mesh, const WideBuildOptions& options);

}  // namespace tessera

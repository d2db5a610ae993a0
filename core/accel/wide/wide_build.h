#pragma once

#include <cstdint>
#include <span>

#include "core/accel/wide/wide_tree.h"
#include "core/bounds/aabb.h"
#include "core/geometry/triangle_mesh.h"

namespace tessera {

/// Of what `build_wide` makes: to be raised whenever that changes, in layout or in quality, as files outlive programs.
inline constexpr std::uint32_t kWideVersion = 4;

struct WideBuildOptions {
  /// Most triangles in a leaf, 1 to 8. With 8 large meshes trace fastest, and take 44 bytes a triangle.
  std::uint32_t leaf_size = 8;
  unsigned threads = 0;  ///< 0: as many as the machine has. The tree doesn't depend on it.
  /// Whether triangles are cut where the boxes of long ones are in each other's way: up to 30% more of them in leaves.
  bool spatial_splits = true;
};

/// The hierarchy of a mesh. Precondition: the mesh is valid. Throws std::length_error if its leaves would take more
/// than 2 GiB: some 50 million triangles.
WideTree build_wide(const TriangleMesh& mesh, const WideBuildOptions& options = {});

/// A hierarchy over boxes, each alone in a leaf, whose `at` is its number; it has no words of its own. Empty boxes are
/// left out. Throws std::length_error if they are too many: 2^27.
WideTree build_wide_over(std::span<const Aabb> boxes, unsigned threads = 0);

}  // namespace tessera

#pragma once

#include <cstdint>

#include "core/accel/wide/wide_tree.h"
#include "core/geometry/triangle_mesh.h"

namespace tessera {

struct WideBuildOptions {
  std::uint32_t leaf_size = 8;  ///< Most triangles in a leaf, 1 to 8.
  unsigned threads = 0;         ///< 0: as many as the machine has. The tree doesn't depend on it.
  bool spatial_splits =
      true;  ///< Where long triangles' boxes are in each other's way, up to 30% more leaves' triangles.
};

/// The hierarchy of a mesh. Triangles whose box is empty are left out. Throws std::length_error if the leaves would
/// take more than 2 GiB.
WideTree build_wide(const TriangleMesh& mesh, const WideBuildOptions& options = {});

}  // namespace tessera

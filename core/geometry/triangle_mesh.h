#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/math/vec.h"

namespace tessera {

using TriangleIndices = std::array<std::uint32_t, 3>;

/// Indexed triangles, counter-clockwise seen from outside. Valid once `drop_unusable_triangles` has run: every
/// index in range, every corner finite, no index twice in a triangle. `normals` is empty (flat shading) or has
/// one entry per position, not necessarily of length 1.
struct TriangleMesh {
  std::vector<Vec3> positions;
  std::vector<TriangleIndices> triangles;
  std::vector<Vec3> normals;
};

/// What a mesh lost on its way in.
struct DroppedTriangles {
  std::uint64_t not_finite = 0;  ///< A corner is NaN, infinite or beyond `kLargestCoordinate`.
  std::uint64_t degenerate = 0;  ///< A vertex index, or a vertex position, occurs twice.

  std::uint64_t total() const { return not_finite + degenerate; }
};

/// Coordinates beyond this would overflow the triangle test's double products or a squared float length.
inline constexpr float kLargestCoordinate = 1e18F;

/// Removes, and counts, triangles that no ray can hit meaningfully. Precondition: all indices in range.
DroppedTriangles drop_unusable_triangles(TriangleMesh& mesh);

}  // namespace tessera

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/math/vec.h"
#include "core/math/vec2.h"

namespace tessera {

using TriangleIndices = std::array<std::uint32_t, 3>;

/// The direction in which u grows, across the normal, not necessarily of length 1. Up in the image, against v, is
/// sign · (normal × direction), as glTF has it.
struct Tangent {
  Vec3 direction;
  float sign = 1;
};

/// What textures ask of a mesh's vertices: each list is empty or has one entry per position; all are finite.
struct MeshAttributes {
  std::array<std::vector<Vec2>, 2> uvs;
  std::vector<Tangent> tangents;             ///< Of the first set of uvs.
  std::vector<std::array<float, 4>> colors;  ///< Linear Rec. 709 and alpha, in 0..1.
};

/// Indexed triangles, counter-clockwise seen from outside. Valid once `drop_unusable_triangles` has run: every
/// index in range, every corner finite, no index twice in a triangle. `normals` is empty (flat shading) or has
/// one entry per position, not necessarily of length 1.
struct TriangleMesh {
  std::vector<Vec3> positions;
  std::vector<TriangleIndices> triangles;
  std::vector<Vec3> normals;
  std::shared_ptr<const MeshAttributes> attributes = {};  ///< Null where it has none.
};

std::size_t memory_bytes(const MeshAttributes& attributes);

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

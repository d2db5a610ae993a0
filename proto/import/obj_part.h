#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "proto/import/import_notes.h"
#include "proto/wire/abandoned.h"

namespace tessera::proto {

/// A corner of an OBJ face: indices into the file's positions and normals.
struct ObjCorner {
  static constexpr std::uint32_t kNoNormal = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t position;
  std::uint32_t normal = kNoNormal;
};

/// The faces of an OBJ file that become one mesh.
struct ObjFaces {
  std::vector<ObjCorner> corners;               ///< Face after face.
  std::vector<std::uint32_t> sizes;             ///< Corners of each face; at least 3.
  std::vector<std::uint32_t> smoothing_groups;  ///< Of each face; 0 for none.
  std::size_t line = 0;                         ///< Of the first face.
};

/// Makes meshes of faces, whose indices must be in range.
class ObjMeshMaker {
 public:
  ObjMeshMaker(const std::vector<Vec3>& positions, const std::vector<Vec3>& normals, ImportNotes& notes, Steps& steps)
      : positions_(positions), normals_(normals), notes_(notes), steps_(steps), newest_(positions.size(), kNone) {}

  /// A vertex for every position, or for every pair of position and normal: all corners have one, or none. Polygons cut
  /// into triangles; nothing left that can't be rendered.
  TriangleMesh make(const ObjFaces& faces);

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  std::uint32_t vertex(ObjCorner corner, TriangleMesh& mesh);

  const std::vector<Vec3>& positions_;
  const std::vector<Vec3>& normals_;
  ImportNotes& notes_;
  Steps& steps_;

  /// The mesh's vertices at one of the file's positions are chained: from the newest to the one before.
  struct Vertex {
    ObjCorner corner;
    std::uint32_t before;
  };
  std::vector<std::uint32_t> newest_;  ///< By the file's position.
  std::vector<Vertex> vertices_;
};

}  // namespace tessera::proto

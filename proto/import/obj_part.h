#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "proto/import/import_notes.h"
#include "proto/wire/abandoned.h"

namespace tessera::proto {

/// A corner of an OBJ face: indices into the file's positions, normals and texture coordinates.
struct ObjCorner {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t position;
  std::uint32_t normal = kNone, texcoord = kNone;

  bool operator==(const ObjCorner&) const = default;
};

/// What an OBJ file says of vertices.
struct ObjVertices {
  std::vector<Vec3> positions, normals;
  std::vector<Vec2> texcoords;               ///< As `MeshAttributes` has them.
  std::vector<std::array<float, 4>> colors;  ///< As `MeshAttributes` has them, of the positions; empty if none has one.
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
  ObjMeshMaker(const ObjVertices& file, ImportNotes& notes, Steps& steps)
      : file_(file), notes_(notes), steps_(steps), newest_(file.positions.size(), kNone) {}

  /// A vertex for every combination of what corners name, of texture coordinates only where they are wanted: of normals
  /// all corners have one, or none. Colours where one isn't white. Polygons cut into triangles; nothing left that can't
  /// be rendered.
  TriangleMesh make(const ObjFaces& faces, bool has_textures);

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  std::uint32_t vertex(ObjCorner corner, TriangleMesh& mesh);
  std::shared_ptr<const MeshAttributes> attributes(bool has_texcoords) const;

  const ObjVertices& file_;
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

#include "proto/import/obj_part.h"

#include <span>

#include "proto/import/mesh_repair.h"
#include "proto/import/polygon.h"

namespace tessera::proto {
namespace {

/// Sharing vertices only saves memory. Where very many normals meet in a position, the search costs more.
constexpr int kLongestSearch = 64;

}  // namespace

TriangleMesh ObjMeshMaker::make(const ObjFaces& faces) {
  TriangleMesh mesh;
  mesh.triangles.reserve(faces.corners.size() - 2 * faces.sizes.size());
  std::vector<std::uint32_t> corners;
  const ObjCorner* next = faces.corners.data();
  for (const std::uint32_t size : faces.sizes) {
    corners.clear();
    for (const ObjCorner corner : std::span(next, size)) {
      corners.push_back(vertex(corner, mesh));
    }
    next += size;
    if (!triangulate(mesh.positions, corners, mesh.triangles, steps_))
      note_lost_polygon(corners.size(), notes_, faces.line);
  }
  for (const Vertex& v : vertices_) newest_[v.corner.position] = kNone;
  vertices_.clear();
  repair_mesh(mesh, notes_, faces.line);
  return mesh;
}

std::uint32_t ObjMeshMaker::vertex(ObjCorner corner, TriangleMesh& mesh) {
  std::uint32_t candidate = newest_[corner.position];
  for (int i = 0; candidate != kNone && i < kLongestSearch; ++i) {
    if (vertices_[candidate].corner.normal == corner.normal) return candidate;
    candidate = vertices_[candidate].before;
  }
  const auto added = static_cast<std::uint32_t>(vertices_.size());
  vertices_.push_back({corner, newest_[corner.position]});
  newest_[corner.position] = added;
  mesh.positions.push_back(positions_[corner.position]);
  if (corner.normal != ObjCorner::kNoNormal) mesh.normals.push_back(normals_[corner.normal]);
  return added;
}

}  // namespace tessera::proto

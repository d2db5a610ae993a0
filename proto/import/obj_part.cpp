#include "proto/import/obj_part.h"

#include <algorithm>
#include <span>
#include <utility>

#include "proto/import/mesh_repair.h"
#include "proto/import/polygon.h"

namespace tessera::proto {
namespace {

/// Sharing vertices only saves memory. Where very many normals meet in a position, the search costs more.
constexpr int kLongestSearch = 64;

}  // namespace

TriangleMesh ObjMeshMaker::make(const ObjFaces& faces, bool has_textures) {
  TriangleMesh mesh;
  const bool has_texcoords = has_textures && std::ranges::any_of(faces.corners, [](ObjCorner corner) {
                               return corner.texcoord != ObjCorner::kNone;
                             });
  if (has_textures && !has_texcoords)
    notes_.add("Faces whose material has textures have no texture coordinates", faces.line);
  mesh.triangles.reserve(faces.corners.size() - 2 * faces.sizes.size());
  std::vector<std::uint32_t> corners;
  const ObjCorner* next = faces.corners.data();
  for (const std::uint32_t size : faces.sizes) {
    corners.clear();
    for (ObjCorner corner : std::span(next, size)) {
      if (!has_texcoords) corner.texcoord = ObjCorner::kNone;
      corners.push_back(vertex(corner, mesh));
    }
    next += size;
    if (!triangulate(mesh.positions, corners, mesh.triangles, steps_))
      note_lost_polygon(corners.size(), notes_, faces.line);
  }
  mesh.attributes = attributes(has_texcoords);
  for (const Vertex& v : vertices_) newest_[v.corner.position] = kNone;
  vertices_.clear();
  repair_mesh(mesh, notes_, faces.line);
  return mesh;
}

std::uint32_t ObjMeshMaker::vertex(ObjCorner corner, TriangleMesh& mesh) {
  std::uint32_t candidate = newest_[corner.position];
  for (int i = 0; candidate != kNone && i < kLongestSearch; ++i) {
    if (vertices_[candidate].corner == corner) return candidate;
    candidate = vertices_[candidate].before;
  }
  const auto added = static_cast<std::uint32_t>(vertices_.size());
  vertices_.push_back({corner, newest_[corner.position]});
  newest_[corner.position] = added;
  mesh.positions.push_back(file_.positions[corner.position]);
  if (corner.normal != ObjCorner::kNone) mesh.normals.push_back(file_.normals[corner.normal]);
  return added;
}

std::shared_ptr<const MeshAttributes> ObjMeshMaker::attributes(bool has_texcoords) const {
  constexpr std::array<float, 4> kWhite{1, 1, 1, 1};
  const bool has_colors = !file_.colors.empty() && std::ranges::any_of(vertices_, [&](const Vertex& v) {
    return file_.colors[v.corner.position] != kWhite;
  });
  if (!has_texcoords && !has_colors) return nullptr;
  MeshAttributes attributes;
  for (const Vertex& v : vertices_) {
    const std::uint32_t texcoord = v.corner.texcoord;
    if (has_texcoords) attributes.uvs[0].push_back(texcoord == ObjCorner::kNone ? Vec2{} : file_.texcoords[texcoord]);
    if (has_colors) attributes.colors.push_back(file_.colors[v.corner.position]);
  }
  return std::make_shared<const MeshAttributes>(std::move(attributes));
}

}  // namespace tessera::proto

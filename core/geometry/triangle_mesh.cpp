#include "core/geometry/triangle_mesh.h"

namespace tessera {

std::size_t memory_bytes(const MeshAttributes& attributes) {
  return sizeof(MeshAttributes) + (attributes.uvs[0].size() + attributes.uvs[1].size()) * sizeof(Vec2) +
         attributes.tangents.size() * sizeof(Tangent) + attributes.colors.size() * sizeof(attributes.colors[0]);
}

DroppedTriangles drop_unusable_triangles(TriangleMesh& mesh) {
  DroppedTriangles dropped;
  const auto unusable = [](Vec3 p) { return !(max_component(abs(p)) <= kLargestCoordinate) || !is_finite(p); };
  std::erase_if(mesh.triangles, [&](const TriangleIndices& t) {
    const Vec3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
    if (unusable(a) || unusable(b) || unusable(c)) return ++dropped.not_finite, true;
    if (a == b || b == c || c == a) return ++dropped.degenerate, true;
    return false;
  });
  return dropped;
}

}  // namespace tessera

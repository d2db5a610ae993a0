#include "core/geometry/shape.h"

namespace tessera {
namespace {

Aabb bounds(const TriangleMesh& mesh) {
  Aabb box;
  for (const TriangleIndices& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle) box.extend(mesh.positions[vertex]);
  return box;
}

}  // namespace

std::uint32_t primitive_count(const Shape& shape) {
  const auto* mesh = std::get_if<TriangleMesh>(&shape);
  return mesh ? static_cast<std::uint32_t>(mesh->triangles.size()) : 1;
}

Aabb bounds(const Shape& shape) {
  return std::visit([](const auto& s) { return bounds(s); }, shape);
}

}  // namespace tessera

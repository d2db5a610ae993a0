#include "core/geometry/shape.h"
#include "core/geometry/triangle.h"

namespace tessera {

SurfacePoint surface(const Shape& shape, std::uint32_t primitive, const Ray& ray, float t) {
  return std::visit(
      [&](const auto& s) {
        if constexpr (std::is_same_v<std::decay_t<decltype(s)>, TriangleMesh>) {
          const TriangleIndices& i = s.triangles[primitive];
          const Vec3 corners[3] = {s.positions[i[0]], s.positions[i[1]], s.positions[i[2]]};
          if (s.normals.empty()) return triangle_surface(TriangleRay(ray), corners, nullptr);
          const Vec3 normals[3] = {s.normals[i[0]], s.normals[i[1]], s.normals[i[2]]};
          return triangle_surface(TriangleRay(ray), corners, normals);
        } else {
          return surface(s, ray, t);
        }
      },
      shape);
}

}  // namespace tessera

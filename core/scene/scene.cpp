#include "core/scene/scene.h"

namespace tessera {

Aabb world_bounds(const Scene& scene, const Object& object) {
  const Aabb local = bounds(scene.shapes[object.shape]);
  if (!object.placement || local.empty()) return local;
  Vec3d lo{kInfinity, kInfinity, kInfinity}, hi = -lo;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d p =
        object.placement->point_to_world({corner & 1 ? local.hi.x : local.lo.x,  //
                                          corner & 2 ? local.hi.y : local.lo.y, corner & 4 ? local.hi.z : local.lo.z});
    lo = min(lo, p);
    hi = max(hi, p);
  }
  return outward(lo, hi);
}

std::size_t memory_bytes(const Scene& scene) {
  std::size_t bytes = sizeof(Scene) + scene.shapes.size() * sizeof(Shape) + scene.objects.size() * sizeof(Object) +
                      scene.materials.size() * sizeof(Material) + scene.lights.size() * sizeof(Light);
  for (const Shape& shape : scene.shapes)
    if (const auto* mesh = std::get_if<TriangleMesh>(&shape))
      bytes += (mesh->positions.size() + mesh->normals.size()) * sizeof(Vec3) +
               mesh->triangles.size() * sizeof(TriangleIndices);
  return bytes;
}

}  // namespace tessera

#include "core/geometry/quad.h"

#include "core/geometry/triangle.h"

namespace tessera {

std::optional<float> intersect(const Quad& quad, const Ray& ray) {
  const auto& [a, b, c, d] = quad.corners;
  const TriangleRay sheared(ray);
  const auto first = intersect_triangle(sheared, a, b, c), second = intersect_triangle(sheared, a, c, d);
  if (first && second) return std::min(*first, *second);
  return first ? first : second;
}

SurfacePoint surface(const Quad& quad, const Ray& ray, float t) {
  const auto& [a, b, c, d] = quad.corners;
  const TriangleRay sheared(ray);
  if (intersect_triangle(sheared, a, b, c) == t) return triangle_surface(sheared, {a, b, c}, nullptr);
  return triangle_surface(sheared, {a, c, d}, nullptr);
}

Aabb bounds(const Quad& quad) {
  Aabb box;
  for (const Vec3 corner : quad.corners) box.extend(corner);
  return box;
}

}  // namespace tessera

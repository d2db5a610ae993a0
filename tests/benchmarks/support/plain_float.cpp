#include "tests/benchmarks/support/plain_float.h"

#include <algorithm>

namespace tessera::bench {

std::unique_ptr<const Accel> PlainFloat::make(const Scene& scene) {
  auto out = std::make_unique<PlainFloat>();
  for (std::uint32_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    if (object.placement) return nullptr;
    const auto add = [&](Vec3 a, Vec3 b, Vec3 c, std::uint32_t primitive) {
      out->triangles_.push_back({a, b - a, c - a, i, primitive});
    };
    if (const auto* mesh = std::get_if<TriangleMesh>(&scene.shapes[object.shape])) {
      for (std::uint32_t t = 0; t < mesh->triangles.size(); ++t) {
        const auto& [a, b, c] = mesh->triangles[t];
        add(mesh->positions[a], mesh->positions[b], mesh->positions[c], t);
      }
    } else if (const auto* quad = std::get_if<Quad>(&scene.shapes[object.shape])) {
      const auto& [a, b, c, d] = quad->corners;
      add(a, b, c, 0);
      add(a, c, d, 0);
    } else {
      return nullptr;
    }
  }
  return out;
}

std::optional<Hit> PlainFloat::closest(const Ray& ray, TraceLog) const {
  Hit best{ray.t_max};
  for (const Triangle& triangle : triangles_) {
    const Vec3 p = cross(ray.direction, triangle.ac);
    const float determinant = dot(triangle.ab, p);
    if (determinant == 0) continue;
    const float inverse = 1 / determinant;
    const Vec3 from = ray.origin - triangle.a;
    const float u = dot(from, p) * inverse;
    if (!(u >= 0 && u <= 1)) continue;
    const Vec3 q = cross(from, triangle.ab);
    const float v = dot(ray.direction, q) * inverse;
    if (!(v >= 0 && u + v <= 1)) continue;
    const float t = dot(triangle.ac, q) * inverse;
    if (t > ray.t_min && t < ray.t_max) best = std::min(best, Hit{t, triangle.object, triangle.primitive});
  }
  if (best.t < ray.t_max) return best;
  return std::nullopt;
}

}  // namespace tessera::bench

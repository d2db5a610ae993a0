#pragma once

#include <cstdint>
#include <type_traits>
#include <variant>

#include "core/bounds/aabb.h"
#include "core/geometry/cone.h"
#include "core/geometry/cylinder.h"
#include "core/geometry/disk.h"
#include "core/geometry/quad.h"
#include "core/geometry/sphere.h"
#include "core/geometry/triangle_mesh.h"

namespace tessera {

/// Everything that can be placed in a scene. A mesh is many primitives, every other shape is one.
using Shape = std::variant<TriangleMesh, Sphere, Cylinder, Cone, Disk, Quad>;

std::uint32_t primitive_count(const Shape& shape);

/// The box of the whole shape; empty for a mesh without triangles. Vertices that no triangle uses don't count.
Aabb bounds(const Shape& shape);

/// The one hit test of a shape that is a single primitive; a mesh is tested triangle by triangle
/// (`intersect_triangle`) and never hit here.
inline std::optional<float> intersect_single(const Shape& shape, const Ray& ray) {
  return std::visit(
      [&](const auto& s) -> std::optional<float> {
        if constexpr (std::is_same_v<std::decay_t<decltype(s)>, TriangleMesh>)
          return std::nullopt;
        else
          return intersect(s, ray);
      },
      shape);
}

/// Where `ray` meets primitive `primitive` of the shape, which it hits at `t`. All in the shape's own space.
SurfacePoint surface(const Shape& shape, std::uint32_t primitive, const Ray& ray, float t);

}  // namespace tessera

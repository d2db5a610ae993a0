#pragma once

#include <memory>
#include <vector>

#include "core/accel/items.h"
#include "core/geometry/triangle_mesh.h"
#include "core/scene/accel_options.h"
#include "core/scene/scene.h"

namespace tessera {

/// The triangles of a mesh, which must outlive this.
class TriangleItems final : public Items {
 public:
  explicit TriangleItems(const TriangleMesh& mesh);

  bool are_primitives() const override { return true; }
  void outline(std::uint32_t item, Outline& out) const override;
  std::optional<std::array<Vec3, 3>> triangle(std::uint32_t item) const override;

 private:
  const TriangleMesh& mesh_;
};

/// The objects of a scene, which must outlive this, as the world sees them.
class ObjectItems final : public Items {
 public:
  /// With `BoundSpace::world` an instance is known by the points of its shape, with `BoundSpace::object` by the box of
  /// its shape in the shape's own space. Outlines are made only where the options ask for other bounds than boxes, or
  /// for boxes around instances in the world that are turned; the others' are empty.
  ObjectItems(const Scene& scene, const AccelOptions& options);

  bool are_primitives() const override { return false; }
  void outline(std::uint32_t item, Outline& out) const override;
  std::optional<std::array<Vec3, 3>> triangle(std::uint32_t) const override { return std::nullopt; }

 private:
  ObjectItems(const Scene& scene, std::vector<Outline> outlines);

  const Scene& scene_;
  std::vector<Outline> outlines_;  ///< By shape, in its own space; empty for one that nobody asks for.
};

}  // namespace tessera

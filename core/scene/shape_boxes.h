#pragma once

#include <mutex>
#include <span>
#include <vector>

#include "core/geometry/shape.h"

namespace tessera {

/// The boxes of shapes, which are looked through for the first who asks: a mesh of a million triangles takes
/// milliseconds. A copy begins anew, so that it may get other shapes. Safe to ask from any thread.
class ShapeBoxes {
 public:
  ShapeBoxes() = default;
  ShapeBoxes(const ShapeBoxes&) noexcept {}
  ShapeBoxes& operator=(const ShapeBoxes& other) noexcept;

  /// One box for each of the shapes, in its own space; empty for a mesh without triangles. Precondition: they are those
  /// of the first call, unless there are more or fewer. Valid until then, and as long as this is.
  std::span<const Aabb> of(std::span<const Shape> shapes) const;

 private:
  mutable std::mutex making_;
  mutable std::vector<Aabb> boxes_;
};

}  // namespace tessera

#include "core/scene/shape_boxes.h"

#include <utility>

#include "core/math/float_environment.h"

namespace tessera {

ShapeBoxes& ShapeBoxes::operator=(const ShapeBoxes& other) noexcept {
  if (this != &other) boxes_.clear();
  return *this;
}

std::span<const Aabb> ShapeBoxes::of(std::span<const Shape> shapes) const {
  const std::lock_guard lock(making_);
  if (boxes_.size() != shapes.size()) {
    const StrictFloats strict;  // whoever asks first
    std::vector<Aabb> boxes;
    boxes.reserve(shapes.size());
    for (const Shape& shape : shapes) boxes.push_back(bounds(shape));
    boxes_ = std::move(boxes);
  }
  return boxes_;
}

}  // namespace tessera

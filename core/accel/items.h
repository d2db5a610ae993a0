#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/bounds/bound.h"

namespace tessera {

/// What an index is built over: a mesh's triangles, or a scene's objects. It knows them by number, box and outline
/// alone. An item with an empty box can't be hit and needn't be kept.
class Items {
 public:
  explicit Items(std::vector<Aabb> boxes) : boxes_(std::move(boxes)) {}
  virtual ~Items() = default;

  std::uint32_t size() const { return static_cast<std::uint32_t>(boxes_.size()); }
  const std::vector<Aabb>& boxes() const { return boxes_; }

  /// Whether an item is one primitive, which costs one test, and not an object, which may be a whole mesh.
  virtual bool are_primitives() const = 0;

  /// Appends what bounding volumes are fitted to.
  virtual void outline(std::uint32_t item, Outline& out) const = 0;

  /// The corners of an item that is a triangle.
  virtual std::optional<std::array<Vec3, 3>> triangle(std::uint32_t item) const = 0;

 private:
  std::vector<Aabb> boxes_;
};

/// A volume of that kind around some of the items.
template <Bound B>
typename B::Volume fit_around(const B& bound, const Items& items, std::span<const std::uint32_t> some) {
  Outline outline;
  for (const std::uint32_t item : some) items.outline(item, outline);
  return bound.fit(outline);
}

}  // namespace tessera

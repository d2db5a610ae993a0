#pragma once

#include <cstdint>

#include "core/accel/accel.h"
#include "core/accel/index.h"
#include "core/accel/items.h"
#include "core/bounds/box_bound.h"

namespace tessera {

/// Every item, in order, unculled: the oracle of all other structures.
class LinearIndex {
 public:
  using BoundType = BoxBound;
  static constexpr bool kCulls = false;
  static constexpr bool kHasRootVolume = false;

  LinearIndex(const Items& items, const BoxBound&, const AccelOptions&) : count_(items.size()) {
    for (const Aabb& box : items.boxes()) root_.extend(box);
  }

  Aabb root() const { return root_; }

  template <typename Counter, typename Leaf>
  void visit(const Ray&, Transform::Error, float limit, Counter, Leaf&& leaf) const {
    for (std::uint32_t item = 0; item < count_; ++item) {
      limit = leaf(item, limit);
      if (limit == kStop) return;
    }
  }

  AccelStats stats() const { return {sizeof(*this), 0, 0, 0}; }

 private:
  Aabb root_;
  std::uint32_t count_;
};

}  // namespace tessera

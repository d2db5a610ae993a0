#pragma once

#include <cstdint>
#include <span>

#include "core/accel/accel.h"
#include "core/bounds/aabb.h"
#include "core/bounds/cull_ray.h"

namespace tessera {

/// Every item, in order, unculled: the oracle of all other structures. The same face as `BoxTree`.
class LinearIndex {
 public:
  static constexpr bool kCulls = false;

  explicit LinearIndex(std::span<const Aabb> boxes) : count_(static_cast<std::uint32_t>(boxes.size())) {
    for (const Aabb& box : boxes) root_.extend(box);
  }

  Aabb root() const { return root_; }

  template <typename Leaf>
  void visit(const CullRay&, float, float limit, Leaf&& leaf) const {
    for (std::uint32_t item = 0; item < count_; ++item) {
      limit = leaf(item, limit);
      if (limit == -kInfinity) return;
    }
  }

  AccelStats stats() const { return {sizeof(*this), 0, 0, 0}; }

 private:
  Aabb root_;
  std::uint32_t count_;
};

}  // namespace tessera

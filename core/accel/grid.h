#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/accel/accel.h"
#include "core/accel/index.h"
#include "core/accel/items.h"
#include "core/accel/mailbox.h"
#include "core/bounds/box_bound.h"
#include "core/bounds/cull_pad.h"

namespace tessera {

/// A uniform grid: each cell lists the items that touch it. Rays walk it layer by layer along the axis on which they
/// run fastest, from near to far; of a layer they visit the cells within the pad of `cull_pad` of their way, so that
/// no rounding of the walk can lose a hit. (Amanatides & Woo 1987 step from cell to cell instead, and accumulate
/// error.) The walk stops before a layer that begins, padded, behind the best hit.
class Grid {
 public:
  using BoundType = BoxBound;
  static constexpr bool kCulls = true;
  static constexpr bool kHasRootVolume = true;

  Grid(const Items& items, const BoxBound&, const AccelOptions& options);

  Aabb root() const { return root_; }

  /// As `BoundTree::visit`; an item in several cells may be visited more than once.
  template <typename Counter, typename Leaf>
  void visit(const Ray& ray, Transform::Error placed, float limit, Counter tally, Leaf&& leaf) const;

  AccelStats stats() const {
    return {cell_begin_.size() * sizeof(std::uint32_t) + items_.size() * sizeof(std::uint32_t),
            cell_begin_.empty() ? 0 : cell_begin_.size() - 1, used_cells_, cell_begin_.empty() ? 0U : 1U};
  }

 private:
  /// A cell's, or a range of cells', place on each axis.
  using Place = std::array<std::int32_t, 3>;

  /// The cells on `axis` that a coordinate range can touch, at least one.
  struct Range {
    std::int32_t first, last;
  };
  Range cells(int axis, double lo, double hi) const {
    const auto index = [&](double x) {
      const double cell = std::floor((x - root_.lo[axis]) * per_cell_[axis]);
      return static_cast<std::int32_t>(std::clamp(cell, 0.0, size_[static_cast<std::size_t>(axis)] - 1.0));
    };
    return {index(lo), index(hi)};
  }
  std::size_t number(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size_[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size_[0]) +
           static_cast<std::size_t>(x);
  }
  /// Cells between two corners, both included.
  struct Block {
    Place first{}, last{};
    std::uint64_t cells() const {
      std::uint64_t product = 1;
      for (std::size_t i = 0; i < 3; ++i) product *= static_cast<std::uint64_t>(last[i] - first[i] + 1);
      return product;
    }
  };
  Block block(const Aabb& box) const;
  Aabb cell_box(Place at) const;
  void choose_size(std::size_t items, std::uint32_t cells_per_item);
  template <typename Visit>
  void for_each_cell(const Items& items, std::uint32_t item, Visit&& visit) const;

  Aabb root_;
  Place size_{1, 1, 1};
  Vec3d width_;                            ///< Of a cell.
  Vec3d per_cell_;                         ///< Its inverse; 0 on an axis without extent.
  std::vector<std::uint32_t> cell_begin_;  ///< Into `items_`, one more than there are cells.
  std::vector<std::uint32_t> items_;
  std::uint64_t used_cells_ = 0;
};

template <typename Counter, typename Leaf>
void Grid::visit(const Ray& ray, Transform::Error placed, float limit, Counter tally, Leaf&& leaf) const {
  if (cell_begin_.empty()) return;
  const double pad = cull_pad(ray, root_, placed);
  const Vec3d o = to_double(ray.origin), d = to_double(ray.direction);
  const Vec3d speed = abs(d);
  const int axis = speed.x >= speed.y && speed.x >= speed.z ? 0 : speed.y >= speed.z ? 1 : 2;
  const int other[2] = {(axis + 1) % 3, (axis + 2) % 3};
  const double inverse = 1 / d[axis];

  // Along the fastest axis alone: |d| there is the largest, so nothing divides by less, and t is off by no more than
  // the pad allows for. The other axes' ranges follow from t.
  const auto t_at = [&](double x) { return (x - o[axis]) * inverse; };
  const double pad_t = pad * std::abs(inverse);
  double t0 = std::max(t_at(inverse > 0 ? root_.lo[axis] : root_.hi[axis]) - pad_t, double{ray.t_min});
  double t1 = std::min(t_at(inverse > 0 ? root_.hi[axis] : root_.lo[axis]) + pad_t, double{limit});
  for (const int i : other) {
    // Where the ray leaves the padded root on the slower axes. One that hardly moves there stays in or out.
    const double inv = 1 / at_least(double{kLeastSlope} * speed[axis], d[i]);
    const double a = (root_.lo[i] - pad - o[i]) * inv, b = (root_.hi[i] + pad - o[i]) * inv;
    t0 = std::max(t0, std::min(a, b));
    t1 = std::min(t1, std::max(a, b));
  }
  tally.volume(t0 <= t1);
  if (!(t0 <= t1)) return;

  Mailbox mailbox;
  const auto x_at = [&](double t) { return o[axis] + t * d[axis]; };
  const double x0 = std::min(x_at(t0), x_at(t1)), x1 = std::max(x_at(t0), x_at(t1));
  const Range layers = cells(axis, x0 - pad, x1 + pad);
  const std::int32_t step = inverse > 0 ? 1 : -1;
  const std::int32_t begin = step > 0 ? layers.first : layers.last,
                     end = (step > 0 ? layers.last : layers.first) + step;
  for (std::int32_t layer = begin; layer != end; layer += step) {
    const double near = root_.lo[axis] + (step > 0 ? layer : layer + 1) * width_[axis];
    const double far = root_.lo[axis] + (step > 0 ? layer + 1 : layer) * width_[axis];
    const double entry = std::max(t_at(near) - pad_t, t0), exit = std::min(t_at(far) + pad_t, t1);
    if (entry > limit) return;
    Place first{}, last{};
    first[static_cast<std::size_t>(axis)] = last[static_cast<std::size_t>(axis)] = layer;
    for (const int i : other) {
      const double a = o[i] + entry * d[i], b = o[i] + exit * d[i];
      const Range range = cells(i, std::min(a, b) - pad, std::max(a, b) + pad);
      first[static_cast<std::size_t>(i)] = range.first;
      last[static_cast<std::size_t>(i)] = range.last;
    }
    for (std::int32_t z = first[2]; z <= last[2]; ++z)
      for (std::int32_t y = first[1]; y <= last[1]; ++y)
        for (std::int32_t x = first[0]; x <= last[0]; ++x) {
          const std::size_t cell = number(x, y, z);
          const std::uint32_t from = cell_begin_[cell], to = cell_begin_[cell + 1];
          tally.volume(from != to);
          if (from == to) continue;
          const auto hits_before = tally.hits();
          bool any = false;
          for (std::uint32_t i = from; i < to; ++i) {
            if (mailbox.met(items_[i])) continue;
            any = true;
            limit = leaf(items_[i], limit);
            if (limit == kStop) return;
          }
          if (any) tally.looked_into(hits_before);
        }
  }
}

}  // namespace tessera

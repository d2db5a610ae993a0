#include "core/accel/grid.h"

#include <limits>

#include "core/accel/build_stop.h"
#include "core/accel/cell_overlap.h"

namespace tessera {
namespace {

constexpr double kMostCells = 1 << 24;

/// Entries in all cells, and cells looked at to make them: coarser cells are taken until these suffice.
std::uint64_t most_entries(std::size_t items) {
  return std::min<std::uint64_t>(32 * std::uint64_t{items} + 4096, std::numeric_limits<std::uint32_t>::max());
}
std::uint64_t most_looked_at(std::size_t items) { return 2 * most_entries(items); }

}  // namespace

Aabb Grid::cell_box(Place at) const {
  Vec3d lo, hi;
  for (int i = 0; i < 3; ++i) {
    const std::int32_t cell = at[static_cast<std::size_t>(i)];
    lo[i] = root_.lo[i] + cell * width_[i];
    hi[i] = root_.lo[i] + (cell + 1) * width_[i];
  }
  return outward(lo, hi);
}

/// Cubic cells, as near as the extents allow (Cleary & Wyvill 1988).
void Grid::choose_size(std::size_t items, std::uint32_t cells_per_item) {
  const Vec3d extent = to_double(root_.hi) - to_double(root_.lo);
  const double wanted = std::min(static_cast<double>(items) * cells_per_item, kMostCells);
  // The axes with an extent share the cells; one that is too thin for a second layer leaves its share to the others.
  std::array<bool, 3> is_flat{};
  for (int round = 0; round < 3; ++round) {
    double volume = 1;
    int axes = 0;
    for (int i = 0; i < 3; ++i) {
      is_flat[static_cast<std::size_t>(i)] |= !(extent[i] > 0);
      if (is_flat[static_cast<std::size_t>(i)]) continue;
      volume *= extent[i];
      ++axes;
    }
    if (axes == 0) break;
    const double side = std::pow(volume / wanted, 1.0 / axes);
    for (int i = 0; i < 3; ++i) {
      auto& size = size_[static_cast<std::size_t>(i)];
      if (is_flat[static_cast<std::size_t>(i)] || !(side > 0)) {
        size = 1;
        continue;
      }
      const double cells = extent[i] / side;
      if (cells < 1) is_flat[static_cast<std::size_t>(i)] = true;
      size = static_cast<std::int32_t>(std::clamp(cells, 1.0, wanted));
    }
  }
}

Grid::Block Grid::block(const Aabb& box) const {
  Block block;
  for (std::size_t i = 0; i < 3; ++i) {
    // A thousandth of a cell dwarfs what `cells` rounds.
    const int axis = static_cast<int>(i);
    const double margin = width_[axis] * 1e-3;
    const Range range = cells(axis, box.lo[axis] - margin, box.hi[axis] + margin);
    block.first[i] = range.first;
    block.last[i] = range.last;
  }
  return block;
}

template <typename Visit>
void Grid::for_each_cell(const Items& items, std::uint32_t item, Visit&& visit) const {
  BuildStop::check();
  const auto [first, last] = block(items.boxes()[item]);
  for (std::int32_t z = first[2]; z <= last[2]; ++z)
    for (std::int32_t y = first[1]; y <= last[1]; ++y)
      for (std::int32_t x = first[0]; x <= last[0]; ++x)
        if (first == last || touches(items, item, cell_box({x, y, z}))) visit(number(x, y, z));
}

Grid::Grid(const Items& items, const BoxBound&, const AccelOptions& options) {
  std::vector<std::uint32_t> kept;
  for (std::uint32_t i = 0; i < items.size(); ++i)
    if (!items.boxes()[i].empty()) {
      kept.push_back(i);
      root_.extend(items.boxes()[i]);
    }
  if (kept.empty()) return;
  // Boxes may reach beyond the largest float; nothing that is hit does, and the cells' arithmetic needs an end.
  constexpr float kLargest = std::numeric_limits<float>::max();
  root_ = {max(root_.lo, Vec3{-kLargest, -kLargest, -kLargest}), min(root_.hi, Vec3{kLargest, kLargest, kLargest})};
  choose_size(kept.size(), options.cells_per_item);

  // Counted, then sorted into place (a bucket sort); counted again with coarser cells while there are too many entries.
  std::vector<std::uint32_t> counts;
  for (std::uint64_t entries = 0, looked_at = 0;; entries = looked_at = 0) {
    for (int i = 0; i < 3; ++i) {
      const std::int32_t size = size_[static_cast<std::size_t>(i)];
      width_[i] = (static_cast<double>(root_.hi[i]) - root_.lo[i]) / size;
      per_cell_[i] = width_[i] > 0 ? 1 / width_[i] : 0;
    }
    counts.assign(number(size_[0] - 1, size_[1] - 1, size_[2] - 1) + 2, 0);
    for (const std::uint32_t item : kept) looked_at += block(items.boxes()[item]).cells();
    if (looked_at <= most_looked_at(kept.size())) {
      for (const std::uint32_t item : kept)
        for_each_cell(items, item, [&](std::size_t cell) {
          ++counts[cell + 1];
          ++entries;
        });
      if (entries <= most_entries(kept.size())) break;
    }
    for (std::int32_t& size : size_) size = std::max(size / 2, 1);
  }
  used_cells_ = static_cast<std::uint64_t>(std::ranges::count_if(counts, [](auto n) { return n > 0; }));
  cell_begin_.resize(counts.size());
  for (std::size_t i = 1; i < counts.size(); ++i) cell_begin_[i] = cell_begin_[i - 1] + counts[i];
  items_.resize(cell_begin_.back());
  std::vector<std::uint32_t> next(cell_begin_.begin(), cell_begin_.end() - 1);
  for (const std::uint32_t item : kept)
    for_each_cell(items, item, [&](std::size_t cell) { items_[next[cell]++] = item; });
}

}  // namespace tessera

#include "core/accel/wide/binned_sah.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

/// A box for each axis along which something is parted.
struct Boxes {
  LanesBox along[3];

  void extend(const Bins& bins, int bin) {
    for (int axis = 0; axis < 3; ++axis) along[axis].extend(bins.box[axis][bin]);
  }
  /// Their half areas. Empty boxes have none.
  Lanes half_areas(Lanes unit) const {
    const Lanes a = edges(0) * unit, b = edges(1) * unit, c = edges(2) * unit;
    const Lanes ab_xy = __builtin_shufflevector(a, b, 0, 4, 1, 5), ab_z = __builtin_shufflevector(a, b, 2, 6, 2, 6);
    const Lanes x = __builtin_shufflevector(ab_xy, c, 0, 1, 4, 4);
    const Lanes y = __builtin_shufflevector(ab_xy, c, 2, 3, 5, 5);
    const Lanes z = __builtin_shufflevector(ab_z, c, 0, 1, 6, 6);
    return x * y + y * z + z * x;
  }

 private:
  Lanes edges(int axis) const { return max(along[axis].hi - along[axis].lo, Lanes{}); }
};

const Boxes kNoBoxes{{LanesBox::empty(), LanesBox::empty(), LanesBox::empty()}};

Lanes to_float(IntLanes i) { return __builtin_convertvector(i, Lanes); }

}  // namespace

BinGrid::BinGrid(const LanesBox& middles, std::uint32_t count)
    : bins_(static_cast<int>(std::min<std::uint32_t>(kMostBins, 4 + count / 4))), base_(middles.lo) {
  // Short of the full number, so that rounding doesn't lead past the last bin.
  const float cells = static_cast<float>(bins_) * (1 - 0x1p-20F);
  for (int axis = 0; axis < 3; ++axis) {
    const float scale = cells / (middles.hi[axis] - middles.lo[axis]);
    scale_[axis] = std::isfinite(scale) ? scale : 0;
  }
  scale_[3] = 0;
  last_ = spread(static_cast<float>(bins_ - 1));
}

Bins::Bins(int bins) : size(bins) {
  for (int bin = 0; bin < size; ++bin) {
    for (auto& along : box) along[bin] = LanesBox::empty();
    entering[bin] = leaving[bin] = IntLanes{};
  }
}

Split Bins::best_split(std::uint32_t count, float unit) const {
  Lanes right_cost[BinGrid::kMostBins];
  IntLanes right[BinGrid::kMostBins + 1];
  right[size] = IntLanes{};
  Boxes side = kNoBoxes;
  for (int bin = size - 1; bin > 0; --bin) {
    side.extend(*this, bin);
    right[bin] = right[bin + 1] + leaving[bin];
    right_cost[bin] = side.half_areas(spread(unit)) * to_float(batches_of(right[bin]));
  }
  side = kNoBoxes;
  const auto all = static_cast<std::int32_t>(count);
  IntLanes left{}, best_bin{}, best_left{};
  Lanes best_cost = spread(kInfinity);
  for (int bin = 1; bin < size; ++bin) {
    side.extend(*this, bin - 1);
    left += entering[bin - 1];
    const Lanes cost = side.half_areas(spread(unit)) * to_float(batches_of(left)) + right_cost[bin];
    const IntLanes is_better = (left < all) & (right[bin] < all) & (cost < best_cost);
    best_cost = is_better ? cost : best_cost;
    best_bin = is_better ? IntLanes{bin, bin, bin, bin} : best_bin;
    best_left = is_better ? left : best_left;
  }
  Split best;
  for (int axis = 0; axis < 3; ++axis)
    if (best_cost[axis] < best.cost) {
      best.axis = axis;
      best.cost = best_cost[axis];
    }
  if (best.axis < 0) return best;
  best.bin = best_bin[best.axis];
  best.left = static_cast<std::uint32_t>(best_left[best.axis]);
  best.right = static_cast<std::uint32_t>(right[best.bin][best.axis]);
  best.left_box = best.right_box = LanesBox::empty();
  for (int bin = 0; bin < size; ++bin) (bin < best.bin ? best.left_box : best.right_box).extend(box[best.axis][bin]);
  return best;
}

Bins bin_middles(std::span<const PrimitiveRef> refs, const BinGrid& grid) {
  Bins bins(grid.bins());
  for (const PrimitiveRef& ref : refs) {
    const WordLanes bin = grid.bins_of(ref.middle());
    for (int axis = 0; axis < 3; ++axis) {
      bins.box[axis][bin[axis]].extend(ref.box());
      ++bins.entering[bin[axis]][axis];
    }
  }
  std::copy_n(bins.entering, bins.size, bins.leaving);
  return bins;
}

}  // namespace tessera

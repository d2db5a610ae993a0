#include <array>

#include "core/accel/plane_tree.h"
#include "core/accel/plane_tree_builder.h"

namespace tessera {
namespace {

/// Takes the axis-aligned plane of the least surface area cost: among the items' own bounds in small nodes, among the
/// borders of bins in large ones.
class KdChooser {
 public:
  using Plane = AxisPlane;
  using Cell = BoxCell;

  KdChooser(const Items& items, const AccelOptions& options)
      : items_(items),
        leaf_size_(options.leaf_size),
        most_depth_(options.max_depth != 0 ? options.max_depth : usual_depth(items.size())) {}

  static BoxCell root(const Aabb& box) { return {box}; }

  Extent extent(std::uint32_t item, const AxisPlane& plane) const { return extent_from(plane, items_.boxes()[item]); }

  std::optional<Cut<AxisPlane>> choose(const CellItems<BoxCell>& at) const {
    if (at.items.size() <= 1 || at.depth >= most_depth_) return std::nullopt;
    Best best;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      if (at.items.size() <= kFewItems)
        try_bounds(at, axis, best);
      else
        try_bins(at, axis, best);
    }
    if (best.cost == kInfinity) return std::nullopt;
    return if_worthwhile(best.plane, best.cost, at, leaf_size_);
  }

 private:
  static constexpr std::size_t kFewItems = 24;
  static constexpr int kBins = 32;

  struct Best {
    AxisPlane plane;
    double cost = kInfinity;  ///< In tests of an item.
  };

  static void offer(const BoxCell& cell, AxisPlane plane, std::size_t below, std::size_t above, Best& best) {
    const int axis = static_cast<int>(plane.axis);
    if (!(cell.bounds.lo[axis] < plane.position && plane.position < cell.bounds.hi[axis])) return;
    const auto [lower, upper] = cell.parts(plane);
    const double area = half_area(cell.bounds);
    if (!(area > 0)) return;
    const double tests =
        (half_area(lower.bounds) * static_cast<double>(below) + half_area(upper.bounds) * static_cast<double>(above)) /
        area;
    const double cost = cost_of_cut(tests, below, above);
    if (cost < best.cost) best = {plane, cost};
  }

  void try_bounds(const CellItems<BoxCell>& at, std::uint32_t axis, Best& best) const {
    const int a = static_cast<int>(axis);
    for (const std::uint32_t candidate : at.items)
      for (const float position : {items_.boxes()[candidate].lo[a], items_.boxes()[candidate].hi[a]}) {
        std::size_t below = 0, above = 0;
        for (const std::uint32_t item : at.items) {
          const Aabb& box = items_.boxes()[item];
          below += box.lo[a] < position || box.hi[a] <= position;
          above += box.hi[a] > position;
        }
        offer(at.cell, {position, axis}, below, above, best);
      }
  }

  /// An item counts below from the bin where it begins on, and above up to the one where it ends.
  void try_bins(const CellItems<BoxCell>& at, std::uint32_t axis, Best& best) const {
    const int a = static_cast<int>(axis);
    const double lo = at.cell.bounds.lo[a], extent = at.cell.bounds.hi[a] - lo, scale = kBins / extent;
    if (!(extent > 0) || !std::isfinite(extent) || !std::isfinite(scale)) return;
    std::array<std::size_t, kBins> begins{}, ends{};
    const auto bin = [&](float x) { return static_cast<std::size_t>(std::clamp((x - lo) * scale, 0.0, kBins - 1.0)); };
    for (const std::uint32_t item : at.items) {
      ++begins[bin(items_.boxes()[item].lo[a])];
      ++ends[bin(items_.boxes()[item].hi[a])];
    }
    std::size_t below = 0, above = at.items.size();
    for (std::size_t border = 1; border < kBins; ++border) {
      below += begins[border - 1];
      above -= ends[border - 1];
      offer(at.cell, {static_cast<float>(lo + static_cast<double>(border) / scale), axis}, below, above, best);
    }
  }

  const Items& items_;
  std::uint32_t leaf_size_;
  std::uint32_t most_depth_;
};

}  // namespace

PlaneNodes<AxisPlane> build_kd(const Items& items, const AccelOptions& options) {
  return PlaneTreeBuilder(items, KdChooser(items, options)).build();
}

}  // namespace tessera

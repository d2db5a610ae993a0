#include "core/accel/plane_tree.h"
#include "core/accel/plane_tree_builder.h"

namespace tessera {
namespace {

/// Halves cells on x, y and z in turn, so that three levels make the eight cells of an octree's node. A half that
/// holds few enough items isn't cut on the axes that are left.
class OctreeChooser {
 public:
  using Plane = AxisPlane;
  using Cell = BoxCell;

  OctreeChooser(const Items& items, const AccelOptions& options)
      : items_(items),
        leaf_size_(options.leaf_size),
        most_depth_(3 * (options.max_depth != 0 ? std::min(options.max_depth, kMostLevels) : kMostLevels)) {}

  static BoxCell root(const Aabb& box) { return {box}; }

  Extent extent(std::uint32_t item, const AxisPlane& plane) const { return extent_from(plane, items_.boxes()[item]); }

  std::optional<Cut<AxisPlane>> choose(const CellItems<BoxCell>& at) const {
    if (at.items.size() <= leaf_size_ || at.depth >= most_depth_ || is_small(at)) return std::nullopt;
    for (std::uint32_t turn = 0; turn < 3; ++turn) {
      const std::uint32_t axis = (at.depth + turn) % 3;
      const float lo = at.cell.bounds.lo[static_cast<int>(axis)], hi = at.cell.bounds.hi[static_cast<int>(axis)];
      const AxisPlane middle{lo * 0.5F + hi * 0.5F, axis};
      if (lo < middle.position && middle.position < hi && parts_some(at.items, middle)) return Cut<AxisPlane>{middle};
    }
    return std::nullopt;
  }

 private:
  static constexpr std::uint32_t kMostLevels = 20;

  /// Whether the cell is so much smaller than each of its items that smaller ones would hardly tell them apart: where
  /// many triangles share a corner, they never would.
  bool is_small(const CellItems<BoxCell>& at) const {
    const float side = max_component(at.cell.bounds.diagonal());
    return std::ranges::all_of(
        at.items, [&](std::uint32_t item) { return max_component(items_.boxes()[item].diagonal()) > 4 * side; });
  }

  /// Whether any item lies on one side alone.
  bool parts_some(const std::vector<std::uint32_t>& items, const AxisPlane& plane) const {
    return std::ranges::any_of(items, [&](std::uint32_t item) {
      const Extent e = extent(item, plane);
      return e.hi <= 0 || e.lo >= 0;
    });
  }

  const Items& items_;
  std::uint32_t leaf_size_;
  std::uint32_t most_depth_;
};

}  // namespace

PlaneNodes<AxisPlane> build_octree(const Items& items, const AccelOptions& options) {
  return PlaneTreeBuilder(items, OctreeChooser(items, options)).build();
}

}  // namespace tessera

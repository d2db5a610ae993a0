#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/accel/build_stop.h"
#include "core/accel/cell_overlap.h"
#include "core/accel/items.h"
#include "core/accel/plane_tree.h"

namespace tessera {

/// What a chooser of planes sees of a node.
template <typename Cell>
struct CellItems {
  const Cell& cell;
  const std::vector<std::uint32_t>& items;
  std::uint32_t depth;     ///< Of the node; the root's is 0.
  std::uint32_t bad_cuts;  ///< Above it, that cost more than they saved by the chooser's own estimate.
};

/// A plane that a chooser took.
template <typename Plane>
struct Cut {
  Plane plane;
  bool is_bad = false;  ///< Worse than no cut, in the hope of better ones below.
};

/// Cuts cells until the chooser takes no plane. A chooser has
///   `Plane`, `Cell` (with `Cell::box()` and `Cell::parts(plane)`), `root(box)`,
///   `extent(item, plane)` {lo, hi} of an item relative to the plane's position,
///   `choose(CellItems)`: a cut, or nothing to make a leaf.
/// An item that straddles the plane goes to both sides, unless it can be shown not to touch one of them. An item that
/// lies in the plane goes below it: cells are closed, and rays that pass within the pad visit both sides.
template <typename Chooser>
class PlaneTreeBuilder {
 public:
  using Plane = typename Chooser::Plane;
  using Cell = typename Chooser::Cell;

  PlaneTreeBuilder(const Items& items, Chooser chooser) : items_(items), chooser_(std::move(chooser)) {}

  PlaneNodes<Plane> build() {
    std::vector<std::uint32_t> all;
    for (std::uint32_t i = 0; i < items_.size(); ++i)
      if (!items_.boxes()[i].empty()) {
        all.push_back(i);
        tree_.root.extend(items_.boxes()[i]);
      }
    if (all.empty()) return std::move(tree_);
    tree_.nodes.emplace_back();
    most_nodes_ = kMostNodesPerItem * all.size() + 4096;
    const double room = kMostEntriesPerItem * static_cast<double>(all.size());
    node(0, chooser_.root(tree_.root), std::move(all), room, 0, 0);
    tree_.nodes.shrink_to_fit();
    return std::move(tree_);
  }

 private:
  /// Entries in all leaves together stay below this many times the items; each part gets its share of the room.
  static constexpr double kMostEntriesPerItem = 12;

  /// Only made-up input comes near it: chains of cells that cut off nothing but empty space.
  static constexpr std::size_t kMostNodesPerItem = 64;

  void node(std::uint32_t at, const Cell& cell, std::vector<std::uint32_t> items, double room, std::uint32_t depth,
            std::uint32_t bad_cuts) {
    BuildStop::check();
    tree_.depth = std::max(tree_.depth, depth + 1);
    const bool has_room = depth + 2 < PlaneNodes<Plane>::kMostDepth && tree_.nodes.size() < most_nodes_;
    const auto cut = has_room ? chooser_.choose({cell, items, depth, bad_cuts}) : std::nullopt;
    if (!cut) return leaf(at, items);
    const auto [below, above] = cell.parts(cut->plane);
    std::vector<std::uint32_t> lower, upper;
    for (const std::uint32_t item : items) {
      const auto extent = chooser_.extent(item, cut->plane);
      const bool is_lower = extent.lo < 0 || extent.hi <= 0, is_upper = extent.hi > 0;
      const bool straddles = is_lower && is_upper;
      if (is_lower && (!straddles || touches(items_, item, below.box()))) lower.push_back(item);
      if (is_upper && (!straddles || touches(items_, item, above.box()))) upper.push_back(item);
    }
    const auto entries = static_cast<double>(lower.size() + upper.size());
    if (entries > room) return leaf(at, items);
    const double lower_room = room * static_cast<double>(lower.size()) / entries, upper_room = room - lower_room;
    items = {};
    const auto children = static_cast<std::uint32_t>(tree_.nodes.size());
    tree_.nodes.resize(children + 2);
    tree_.nodes[at] = {cut->plane, children};
    bad_cuts += cut->is_bad ? 1 : 0;
    node(children, below, std::move(lower), lower_room, depth + 1, bad_cuts);
    node(children + 1, above, std::move(upper), upper_room, depth + 1, bad_cuts);
  }

  void leaf(std::uint32_t at, const std::vector<std::uint32_t>& items) {
    tree_.nodes[at] = {{}, static_cast<std::uint32_t>(tree_.items.size()), static_cast<std::uint32_t>(items.size())};
    tree_.items.insert(tree_.items.end(), items.begin(), items.end());
    ++tree_.leaves;
  }

  const Items& items_;
  Chooser chooser_;
  PlaneNodes<Plane> tree_;
  std::size_t most_nodes_ = 0;
};

/// A box as a cell.
struct BoxCell {
  Aabb bounds;

  const Aabb& box() const { return bounds; }
  std::pair<BoxCell, BoxCell> parts(const AxisPlane& plane) const {
    const int axis = static_cast<int>(plane.axis);
    BoxCell below = *this, above = *this;
    below.bounds.hi[axis] = above.bounds.lo[axis] = plane.position;
    return {below, above};
  }
};

/// Where a box begins and ends, relative to the plane.
inline Extent extent_from(const AxisPlane& plane, const Aabb& box) {
  const int axis = static_cast<int>(plane.axis);
  return {static_cast<double>(box.lo[axis]) - plane.position, static_cast<double>(box.hi[axis]) - plane.position};
}

// The surface area heuristic of kd-trees and BSPs (MacDonald & Booth 1990), in tests of an item.

/// A step down costs about what a test costs, measured on the SPD scenes.
inline constexpr double kStepCost = 1;

/// `tests` is what the parts' items cost by the chance to meet them; an empty part is worth a little more than that
/// says.
inline double cost_of_cut(double tests, std::size_t below, std::size_t above) {
  constexpr double kEmptyBonus = 0.8;
  return kStepCost + (below == 0 || above == 0 ? kEmptyBonus : 1) * tests;
}

/// The cut, if it costs less than testing all items of the cell, or if there are more than `leaf_size` and it doesn't
/// cost much more: up to three times on the way down a cut may be bad, for a better one below it.
template <typename Plane, typename Cell>
std::optional<Cut<Plane>> if_worthwhile(const Plane& plane, double cost, const CellItems<Cell>& at,
                                        std::uint32_t leaf_size) {
  constexpr std::uint32_t kMostBadCuts = 3;
  const auto leaf_cost = static_cast<double>(at.items.size());
  if (cost < leaf_cost) return Cut<Plane>{plane, false};
  if (at.items.size() <= leaf_size || cost > 4 * leaf_cost || at.bad_cuts >= kMostBadCuts) return std::nullopt;
  return Cut<Plane>{plane, true};
}

/// How deep a tree over so many items goes when nobody says: Pharr, Jakob & Humphreys, PBRT 3rd ed., 4.4.
inline std::uint32_t usual_depth(std::size_t items) {
  return static_cast<std::uint32_t>(8 + 1.3 * std::log2(static_cast<double>(items) + 1));
}

}  // namespace tessera

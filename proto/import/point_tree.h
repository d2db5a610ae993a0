#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "proto/wire/abandoned.h"

namespace tessera::proto {

/// A point in the plane.
struct Point {
  double x, y;
  bool operator==(const Point&) const = default;
};

/// Twice the area of the triangle; > 0 when it runs counter-clockwise. Differences of floats are exact in double
/// unless their exponents are far apart, so the sign is wrong for slivers at most.
inline double turn(Point a, Point b, Point c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

/// Answers which of a set of points lie in a triangle, while points come and go: a balanced k-d tree (Bentley 1975)
/// over all of them whose nodes know the box of those that are in the set now.
class PointTree {
 public:
  /// `is_in_set` tells of each point whether it is in the set at first. `points` must outlive the tree.
  PointTree(std::span<const Point> points, std::vector<bool> is_in_set, Steps& steps);

  void insert(std::uint32_t point);
  void erase(std::uint32_t point);

  /// Whether `matches(i)` holds for a point i of the set in the triangle, its sides included. `turn` with the
  /// triangle's sides must be at least 0 for every point that could match; points at its first and third corner never
  /// do, nor with `passes_tip` those at its second.
  template <typename Matches>
  bool any_in(const std::array<Point, 3>& triangle, bool passes_tip, const Matches& matches) const {
    Box box;
    for (const Point corner : triangle) box.add({corner, corner});
    return any_in(0, triangle, passes_tip, box, matches);
  }

 private:
  static constexpr std::size_t kPointsInLeaf = 16;

  struct Box {
    Point lo{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    Point hi{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    bool operator==(const Box&) const = default;
    bool meets(const Box& other) const {
      return lo.x <= other.hi.x && hi.x >= other.lo.x && lo.y <= other.hi.y && hi.y >= other.lo.y;
    }
    void add(const Box& other) {
      lo = {std::min(lo.x, other.lo.x), std::min(lo.y, other.lo.y)};
      hi = {std::max(hi.x, other.hi.x), std::max(hi.y, other.hi.y)};
    }
  };

  void build(std::size_t node, std::uint32_t begin, std::uint32_t end);
  bool is_leaf(std::size_t node) const { return node >= first_leaf_; }
  std::span<const std::uint32_t> points_in(std::size_t leaf) const;
  Box box_of_leaf(std::size_t leaf) const;
  /// After a change in `leaf`.
  void update_boxes(std::size_t leaf);

  /// Rounding is monotonic, so that no point of the box has a turn greater than the corner's that is tried.
  static bool is_beyond(const Box& box, Point a, Point b) {
    return turn(a, b, {b.y >= a.y ? box.lo.x : box.hi.x, b.x >= a.x ? box.hi.y : box.lo.y}) < 0;
  }

  template <typename Matches>
  bool any_in(std::size_t node, const std::array<Point, 3>& triangle, bool passes_tip, const Box& around,
              const Matches& matches) const {
    steps_.take();
    const auto& [a, b, c] = triangle;
    const Box& box = boxes_[node];
    if (!box.meets(around) || is_beyond(box, a, b) || is_beyond(box, b, c) || is_beyond(box, c, a)) return false;
    // Very many points may be at one corner of the triangle.
    if (box.lo == box.hi && (box.lo == a || box.lo == c || (passes_tip && box.lo == b))) return false;
    if (!is_leaf(node))
      return any_in(2 * node + 1, triangle, passes_tip, around, matches) ||
             any_in(2 * node + 2, triangle, passes_tip, around, matches);
    for (const std::uint32_t point : points_in(node)) {
      if (is_in_set_[point] && matches(point)) return true;
    }
    return false;
  }

  std::span<const Point> points_;
  Steps& steps_;
  std::vector<std::uint32_t> order_;       ///< The points, leaf after leaf.
  std::vector<Box> boxes_;                 ///< By node: a node's children are 2 · node + 1 and + 2.
  std::vector<std::uint32_t> leaf_begin_;  ///< In `order_`, by leaf; one more at the end.
  std::vector<std::uint32_t> leaf_of_;     ///< By point.
  std::vector<bool> is_in_set_;
  std::size_t first_leaf_ = 0;
};

}  // namespace tessera::proto

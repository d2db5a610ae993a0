#include "proto/import/point_tree.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace tessera::proto {

PointTree::PointTree(std::span<const Point> points, std::vector<bool> is_in_set, Steps& steps)
    : points_(points), steps_(steps), order_(points.size()), leaf_of_(points.size()), is_in_set_(std::move(is_in_set)) {
  std::size_t leaves = 1;
  while (leaves * kPointsInLeaf < points.size()) leaves *= 2;
  first_leaf_ = leaves - 1;
  boxes_.resize(2 * leaves - 1);
  std::iota(order_.begin(), order_.end(), 0U);
  build(0, 0, static_cast<std::uint32_t>(order_.size()));
  leaf_begin_.push_back(static_cast<std::uint32_t>(order_.size()));
  for (std::size_t node = boxes_.size(); node-- > 0;) {
    if (is_leaf(node)) {
      boxes_[node] = box_of_leaf(node);
    } else {
      boxes_[node].add(boxes_[2 * node + 1]);
      boxes_[node].add(boxes_[2 * node + 2]);
    }
  }
}

void PointTree::build(std::size_t node, std::uint32_t begin, std::uint32_t end) {
  if (is_leaf(node)) {
    leaf_begin_.push_back(begin);
    for (std::uint32_t i = begin; i < end; ++i) leaf_of_[order_[i]] = static_cast<std::uint32_t>(node);
    return;
  }
  Box box;
  for (std::uint32_t i = begin; i < end; ++i) box.add({points_[order_[i]], points_[order_[i]]});
  const bool is_wide = box.hi.x - box.lo.x >= box.hi.y - box.lo.y;
  const std::uint32_t middle = begin + (end - begin) / 2;
  const auto at = [&](std::uint32_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
    steps_.take();
    return is_wide ? points_[a].x < points_[b].x : points_[a].y < points_[b].y;
  });
  build(2 * node + 1, begin, middle);
  build(2 * node + 2, middle, end);
}

std::span<const std::uint32_t> PointTree::points_in(std::size_t leaf) const {
  const std::size_t i = leaf - first_leaf_;
  return std::span(order_).subspan(leaf_begin_[i], leaf_begin_[i + 1] - leaf_begin_[i]);
}

void PointTree::insert(std::uint32_t point) {
  if (is_in_set_[point]) return;
  is_in_set_[point] = true;
  update_boxes(leaf_of_[point]);
}

void PointTree::erase(std::uint32_t point) {
  if (!is_in_set_[point]) return;
  is_in_set_[point] = false;
  update_boxes(leaf_of_[point]);
}

PointTree::Box PointTree::box_of_leaf(std::size_t leaf) const {
  Box box;
  for (const std::uint32_t point : points_in(leaf)) {
    if (is_in_set_[point]) box.add({points_[point], points_[point]});
  }
  return box;
}

void PointTree::update_boxes(std::size_t leaf) {
  Box box = box_of_leaf(leaf);
  for (std::size_t node = leaf; box != boxes_[node]; node = (node - 1) / 2) {
    boxes_[node] = box;
    if (node == 0) return;
    const std::size_t sibling = node % 2 == 1 ? node + 1 : node - 1;
    box.add(boxes_[sibling]);
    steps_.take();
  }
}

}  // namespace tessera::proto

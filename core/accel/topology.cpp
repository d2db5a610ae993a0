#include "core/accel/topology.h"

#include <algorithm>
#include <array>

#include "core/accel/build_stop.h"

namespace tessera {
namespace {

/// Splits items top-down. Below `kSahDepth` a node is halved by count instead, so that coordinates made to defeat
/// the heuristic cost at most 32 further levels.
class Builder {
 public:
  Builder(Topology& tree, std::span<const Aabb> boxes, std::uint32_t leaf_size, LeafRule rule)
      : tree_(tree), boxes_(boxes), leaf_size_(leaf_size), rule_(rule) {
    for (std::uint32_t i = 0; i < boxes.size(); ++i)
      if (!boxes[i].empty()) tree_.items.push_back(i);
    if (tree_.items.empty()) return;
    tree_.nodes.reserve(tree_.items.size() * 2);
    tree_.nodes.emplace_back();
    build(0, 0, static_cast<std::uint32_t>(tree_.items.size()), 1);
    tree_.nodes.shrink_to_fit();
  }

 private:
  static constexpr int kBins = 16;
  static constexpr int kSahDepth = 63;
  /// A step down against a test of an item: on the standard scenes 0.5 traced up to a tenth faster than 1 or 2.
  static constexpr double kStepCost = 0.5;

  struct Bin {
    Aabb box;
    std::uint32_t count = 0;
  };
  struct Split {
    int axis = -1;  ///< −1: none found.
    int bin = 0;    ///< Items in bins below it go left.
    double cost = kInfinity;
  };

  Vec3 centroid(std::uint32_t item) const { return boxes_[item].center(); }

  static int bin_of(float c, float lo, float scale) {
    return std::clamp(static_cast<int>((c - lo) * scale), 0, kBins - 1);
  }
  static float bin_scale(float extent) { return kBins * (1 - 0x1p-20F) / extent; }

  void build(std::uint32_t node, std::uint32_t begin, std::uint32_t end, std::uint32_t depth) {
    BuildStop::check();
    tree_.depth = std::max(tree_.depth, depth);
    Aabb box, centroids;
    for (std::uint32_t i = begin; i < end; ++i) {
      box.extend(boxes_[tree_.items[i]]);
      centroids.extend(centroid(tree_.items[i]));
    }
    const std::uint32_t count = end - begin;
    const bool is_leaf = count == 1 || (rule_ == LeafRule::fullest && count <= leaf_size_);
    const std::uint32_t middle = is_leaf ? end : split(begin, end, box, centroids, depth);
    if (middle == end) {
      tree_.nodes[node] = {box, begin, count};
      ++tree_.leaves;
      return;
    }
    const auto children = static_cast<std::uint32_t>(tree_.nodes.size());
    tree_.nodes.resize(children + 2);
    tree_.nodes[node] = {box, children, 0};
    build(children, begin, middle, depth + 1);
    build(children + 1, middle, end, depth + 1);
  }

  /// Partitions the items and returns where the right half begins, or `end` for a leaf.
  std::uint32_t split(std::uint32_t begin, std::uint32_t end, const Aabb& box, const Aabb& centroids,
                      std::uint32_t depth) {
    const std::uint32_t count = end - begin;
    const Split best = depth < kSahDepth ? find_split(begin, end, centroids) : Split{};
    const double leaf_cost = count * half_area(box);
    const bool worthwhile = best.axis >= 0 && best.cost + kStepCost * half_area(box) < leaf_cost;
    if (!worthwhile && count <= leaf_size_ && rule_ == LeafRule::cheapest) return end;
    if (best.axis < 0) return begin + count / 2;
    const float lo = centroids.lo[best.axis], scale = bin_scale(centroids.hi[best.axis] - lo);
    const auto first = tree_.items.begin() + begin, last = tree_.items.begin() + end;
    const auto right = std::partition(
        first, last, [&](std::uint32_t item) { return bin_of(centroid(item)[best.axis], lo, scale) < best.bin; });
    return begin + static_cast<std::uint32_t>(right - first);
  }

  Split find_split(std::uint32_t begin, std::uint32_t end, const Aabb& centroids) const {
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
      const float lo = centroids.lo[axis], extent = centroids.hi[axis] - lo;
      const float scale = bin_scale(extent);
      if (!(extent > 0) || !std::isfinite(extent) || !std::isfinite(scale)) continue;
      std::array<Bin, kBins> bins;
      for (std::uint32_t i = begin; i < end; ++i) {
        const std::uint32_t item = tree_.items[i];
        Bin& bin = bins[static_cast<std::size_t>(bin_of(centroid(item)[axis], lo, scale))];
        bin.box.extend(boxes_[item]);
        ++bin.count;
      }
      std::array<double, kBins> right_cost{};
      Bin right;
      for (int b = kBins - 1; b > 0; --b) {
        right.box.extend(bins[static_cast<std::size_t>(b)].box);
        right.count += bins[static_cast<std::size_t>(b)].count;
        right_cost[static_cast<std::size_t>(b)] = right.count * half_area(right.box);
      }
      Bin left;
      for (int b = 1; b < kBins; ++b) {
        left.box.extend(bins[static_cast<std::size_t>(b) - 1].box);
        left.count += bins[static_cast<std::size_t>(b) - 1].count;
        if (left.count == 0 || left.count == end - begin) continue;
        const double cost = left.count * half_area(left.box) + right_cost[static_cast<std::size_t>(b)];
        if (cost < best.cost) best = {axis, b, cost};
      }
    }
    return best;
  }

  Topology& tree_;
  std::span<const Aabb> boxes_;
  std::uint32_t leaf_size_;
  LeafRule rule_;
};

}  // namespace

Topology make_topology(std::span<const Aabb> boxes, std::uint32_t leaf_size, LeafRule rule) {
  Topology tree;
  Builder(tree, boxes, leaf_size, rule);
  return tree;
}

}  // namespace tessera

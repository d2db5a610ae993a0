#include "core/accel/wide/collapse.h"

#include <vector>

#include <gtest/gtest.h>

#include "core/accel/wide/primitive_refs.h"
#include "tests/support/random.h"

namespace tessera {
namespace {

/// A random binary tree with random areas, parents' greater than children's, and every way to collapse it.
class RandomTree {
 public:
  RandomTree(std::uint64_t seed, int leaves) : random_(seed) {
    nodes_.resize(1);
    area_.resize(1);
    costs_.resize(1);
    grow(0, leaves, 1);
  }

  const BinaryNode* nodes() const { return nodes_.data(); }
  const SlotCosts& costs(std::uint32_t node) const { return costs_[node]; }
  bool is_leaf(std::uint32_t node) const { return nodes_[node].is_leaf(); }

  /// What the plan says, added up.
  double planned(std::uint32_t node) const {
    if (is_leaf(node)) return costs_[node][0];
    std::array<std::uint32_t, WideNode::kChildren> children;
    const std::size_t count = collapsed_children(nodes(), node, children);
    double sum = area_[node];
    for (std::size_t i = 0; i < count; ++i) sum += planned(children[i]);
    return sum;
  }

  /// The cheapest of all ways to give the node up to `slots` slots.
  double least(std::uint32_t node, int slots) const {
    if (is_leaf(node)) return costs_[node][0];
    double best = area_[node] + parted(node, WideNode::kChildren);
    if (slots > 1) best = std::min(best, parted(node, slots));
    return best;
  }

 private:
  double parted(std::uint32_t node, int slots) const {
    double best = 1e30;
    for (int left = 1; left < slots; ++left)
      best = std::min(best, least(nodes_[node].first(), left) + least(nodes_[node].first() + 1, slots - left));
    return best;
  }

  void grow(std::uint32_t node, int leaves, float area) {
    area_[node] = area;
    const LanesBox box{Lanes{}, Lanes{}};
    if (leaves == 1) {
      nodes_[node] = BinaryNode::leaf(box, 0, 3);
      costs_[node] = leaf_costs(area, 3);
      return;
    }
    const auto pair = static_cast<std::uint32_t>(nodes_.size());
    nodes_.resize(pair + 2);
    area_.resize(pair + 2);
    costs_.resize(pair + 2);
    const int left = 1 + static_cast<int>(random_.bits() % static_cast<std::uint64_t>(leaves - 1));
    grow(pair, left, area * static_cast<float>(random_.uniform(0.3, 0.95)));
    grow(pair + 1, leaves - left, area * static_cast<float>(random_.uniform(0.3, 0.95)));
    std::uint32_t plan;
    costs_[node] = inner_costs(area, costs_[pair], costs_[pair + 1], plan);
    nodes_[node] = BinaryNode::inner(box, pair, plan);
  }

  Random random_;
  std::vector<BinaryNode> nodes_;
  std::vector<float> area_;
  std::vector<SlotCosts> costs_;
};

TEST(Collapse, CostsAreThoseOfTheBestWay) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const RandomTree tree(seed, 2 + static_cast<int>(seed % 7));
    for (int slots = 1; slots < WideNode::kChildren; ++slots)
      EXPECT_NEAR(tree.costs(0)[static_cast<std::size_t>(slots - 1)], tree.least(0, slots), 1e-4) << seed;
  }
}

TEST(Collapse, PlansLeadToTheCostsTheyPromise) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const RandomTree tree(seed, 2 + static_cast<int>(seed * 3));
    EXPECT_NEAR(tree.costs(0)[0], tree.planned(0), 1e-3 * tree.planned(0)) << seed;
  }
}

TEST(Collapse, UpToEightLeavesHangInOneNode) {
  for (int leaves = 2; leaves <= WideNode::kChildren; ++leaves) {
    const RandomTree tree(7, leaves);
    std::array<std::uint32_t, WideNode::kChildren> children;
    EXPECT_EQ(collapsed_children(tree.nodes(), 0, children), static_cast<std::size_t>(leaves));
  }
}

}  // namespace
}  // namespace tessera

#include "core/accel/wide/collapse.h"

#include <algorithm>

namespace tessera {
namespace {

// What a ray pays that enters a node; that enters a leaf; and for each of its triangles, which are tested all at once.
constexpr float kNodeCost = 1;
constexpr float kLeafCost = 1;
constexpr float kTriangleCost = 0.1F;

/// A plan is a number of three bits for 2 … 8 slots each: how many of them the left child gets; 0 for one slot less.
constexpr std::uint32_t left_slots(std::uint32_t plan, std::uint32_t slots) { return plan >> (3 * (slots - 2)) & 7; }

/// The cheapest way to deal `slots` to two children.
struct Deal {
  float cost;
  std::uint32_t left;
};
Deal deal(const SlotCosts& left, const SlotCosts& right, std::uint32_t slots) {
  Deal best{kInfinity, 1};
  for (std::uint32_t l = 1; l < slots; ++l) {
    const float cost = left[l - 1] + right[slots - l - 1];
    if (cost < best.cost) best = {cost, l};
  }
  return best;
}

struct Children {
  const BinaryNode* nodes;
  std::uint32_t* out;
  std::size_t count = 0;

  void collect(std::uint32_t node, std::uint32_t slots) {
    const BinaryNode& n = nodes[node];
    if (!n.is_leaf())
      for (; slots > 1; --slots)
        if (const std::uint32_t left = left_slots(n.plan(), slots)) {
          collect(n.first(), left);
          collect(n.first() + 1, slots - left);
          return;
        }
    out[count++] = node;
  }
};

}  // namespace

SlotCosts leaf_costs(float half_area, std::uint32_t count) {
  SlotCosts costs;
  costs.fill(half_area * (kLeafCost + kTriangleCost * static_cast<float>(count)));
  return costs;
}

SlotCosts inner_costs(float half_area, const SlotCosts& left, const SlotCosts& right, std::uint32_t& plan) {
  SlotCosts costs;
  const Deal all = deal(left, right, WideNode::kChildren);
  plan = all.left << (3 * (WideNode::kChildren - 2));
  costs[0] = half_area * kNodeCost + all.cost;
  for (std::uint32_t slots = 2; slots < WideNode::kChildren; ++slots) {
    const Deal some = deal(left, right, slots);
    const bool pays = some.cost < costs[slots - 2];
    costs[slots - 1] = pays ? some.cost : costs[slots - 2];
    if (pays) plan |= some.left << (3 * (slots - 2));
  }
  return costs;
}

std::size_t collapsed_children(const BinaryNode* nodes, std::uint32_t node,
                               std::span<std::uint32_t, WideNode::kChildren> out) {
  Children children{nodes, out.data()};
  children.collect(node, WideNode::kChildren);
  return children.count;
}

}  // namespace tessera

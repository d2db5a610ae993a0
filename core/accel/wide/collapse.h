#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/accel/wide/binary_tree.h"
#include "core/accel/wide/wide_tree.h"

namespace tessera {

/// What tracing is expected to cost below a binary node if it takes up to 1, 2 … 7 slots of its parent: the surface
/// area heuristic, kept for every number of slots (Ylitie, Karras & Laine 2017, sec. 3.1). In units of a half area.
using SlotCosts = std::array<float, WideNode::kChildren - 1>;

/// Of a leaf, which takes one slot whatever it is given.
SlotCosts leaf_costs(float half_area, std::uint32_t count);

/// Of a node over two others; `plan` says what to do with each number of slots.
SlotCosts inner_costs(float half_area, const SlotCosts& left, const SlotCosts& right, std::uint32_t& plan);

/// The cheapest children of the wide node that stands for a binary one: numbers of binary nodes, in `out`. Returns how
/// many.
std::size_t collapsed_children(const BinaryNode* nodes, std::uint32_t node,
                               std::span<std::uint32_t, WideNode::kChildren> out);

}  // namespace tessera

#include "core/accel/wide/wide_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/accel/wide/triangle_corners.h"

namespace tessera {
namespace {

constexpr int kSteps = 255;

/// Lattice coordinates are quotients of doubles: a difference, a reciprocal and a product, each off by 2^-53 of itself
/// at most. So what is moved by this part of itself errs to the safe side.
constexpr double kQuotientError = 0x1p-50;

/// Whether `kSteps` steps reach from one end of the node to the other with room for `kQuotientError`: `above` leaves
/// 2^-24. Never denormal, so that it is what it is where denormals are flushed to zero.
float lattice_step(double extent) { return std::max(above(extent / kSteps), std::numeric_limits<float>::min()); }

void set_boxes(WideNode& node, std::span<const Aabb> boxes) {
  Aabb all;
  for (const Aabb& box : boxes) all.extend(box);
  for (int axis = 0; axis < 3; ++axis) {
    const double origin = all.lo[axis];
    node.origin[axis] = all.lo[axis];
    node.step[axis] = lattice_step(all.hi[axis] - origin);
    const double scale = 1 / double{node.step[axis]};
    for (std::size_t i = 0; i < WideNode::kChildren; ++i) {
      const Aabb& box = boxes[i < boxes.size() ? i : 0];
      const double lo = (box.lo[axis] - origin) * scale, hi = (box.hi[axis] - origin) * scale;
      node.lo[axis][i] = static_cast<std::uint8_t>(lo * (1 - kQuotientError));
      node.hi[axis][i] = static_cast<std::uint8_t>(std::ceil(hi * (1 + kQuotientError)));
    }
  }
}

void pack_order(std::uint8_t (&packed)[3], std::span<const std::uint8_t, WideNode::kChildren> order) {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < order.size(); ++i) bits |= std::uint32_t{order[i]} << (3 * i);
  for (std::size_t byte = 0; byte < 3; ++byte) packed[byte] = static_cast<std::uint8_t>(bits >> (8 * byte));
}

/// Children are ordered by their middles along the octant's diagonal. The opposite octant's order is the reverse.
void set_orders(WideNode& node, std::span<const Aabb> boxes) {
  const std::size_t count = boxes.size();
  for (unsigned octant = 0; octant < 4; ++octant) {
    double key[WideNode::kChildren] = {};
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d middle = to_double(boxes[i].lo) + to_double(boxes[i].hi);
      key[i] = (octant & 1 ? -middle.x : middle.x) + (octant & 2 ? -middle.y : middle.y) + middle.z;
    }
    std::uint8_t order[WideNode::kChildren] = {0, 1, 2, 3, 4, 5, 6, 7};
    for (std::size_t i = 0; i < count; ++i) {
      std::size_t place = 0;
      for (std::size_t j = 0; j < count; ++j) place += key[j] < key[i] || (key[j] == key[i] && j < i);
      order[place] = static_cast<std::uint8_t>(i);
    }
    pack_order(node.order[octant], order);
    std::reverse(order, order + count);
    pack_order(node.order[7 - octant], order);
  }
}

}  // namespace

WideNode make_wide_node(std::span<const Aabb> boxes) {
  WideNode node;
  set_boxes(node, boxes);
  set_orders(node, boxes);
  std::fill(std::begin(node.child), std::end(node.child), kNoChild);
  return node;
}

std::uint32_t write_leaf(const TriangleMesh& mesh, std::span<const std::uint32_t> triangles, std::uint32_t* words) {
  const std::size_t count = triangles.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Corners corners = corners_of(mesh, triangles[i]);
    std::uint32_t* column = words + i;
    for (const Lanes corner : corners) {
      const auto bits = reinterpret_cast<WordLanes>(corner);
      column[0] = bits[0];
      column[count] = bits[1];
      column[2 * count] = bits[2];
      column += 3 * count;
    }
    *column = triangles[i];
  }
  const std::uint32_t size = leaf_words(static_cast<std::uint32_t>(count));
  std::fill(words + 10 * count, words + size, 0U);
  return size;
}

}  // namespace tessera

#include "core/accel/wide/wide_build.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/accel/topology.h"
#include "core/accel/wide/wide_layout.h"

namespace tessera {
namespace {

struct Storage {
  std::vector<WideNode> nodes;
  std::vector<std::uint32_t> leaves;
};

class Collapse {
 public:
  Collapse(const TriangleMesh& mesh, const Topology& binary, Storage& out, AccelStats& stats)
      : mesh_(mesh), binary_(binary), out_(out), stats_(stats) {}

  /// Appends the wide node that stands for a node of the binary tree, and all below it.
  std::uint32_t node(std::uint32_t root, std::uint32_t depth) {
    stats_.depth = std::max(stats_.depth, depth);
    std::array<std::uint32_t, WideNode::kChildren> below{root};
    std::size_t count = 1;
    while (count < WideNode::kChildren) {
      const auto widest = std::max_element(below.begin(), below.begin() + count,
                                           [&](std::uint32_t a, std::uint32_t b) { return gain(a) < gain(b); });
      if (gain(*widest) < 0) break;
      const std::uint32_t first = binary_.nodes[*widest].first;
      *widest = first;
      below[count++] = first + 1;
    }
    std::array<Aabb, WideNode::kChildren> boxes;
    for (std::size_t i = 0; i < count; ++i) boxes[i] = binary_.nodes[below[i]].box;
    const auto self = static_cast<std::uint32_t>(out_.nodes.size());
    out_.nodes.push_back(make_wide_node({boxes.data(), count}));
    for (std::size_t i = 0; i < count; ++i) {
      const Topology::Node& child = binary_.nodes[below[i]];
      out_.nodes[self].child[i] = child.count > 0 ? leaf(child) : 0;
    }
    for (std::size_t i = 0; i < count; ++i)
      if (binary_.nodes[below[i]].count == 0) {
        const std::uint32_t at = node(below[i], depth + 1);
        out_.nodes[self].child[i] = at;
      }
    return self;
  }

 private:
  /// By how much opening the node promises to help; negative for a leaf.
  double gain(std::uint32_t i) const {
    const Topology::Node& node = binary_.nodes[i];
    return node.count > 0 ? -1 : half_area(node.box);
  }

  std::uint32_t leaf(const Topology::Node& node) {
    const std::size_t at = out_.leaves.size();
    if (at / 4 >= WideChild::kMostQuads)
      throw std::length_error("a mesh has more triangles than a wide tree can number");
    out_.leaves.resize(at + leaf_words(node.count));
    write_leaf(mesh_, {binary_.items.data() + node.first, node.count}, out_.leaves.data() + at);
    ++stats_.leaves;
    return WideChild::leaf(static_cast<std::uint32_t>(at / 4), node.count);
  }

  const TriangleMesh& mesh_;
  const Topology& binary_;
  Storage& out_;
  AccelStats& stats_;
};

}  // namespace

WideTree build_wide(const TriangleMesh& mesh, const WideBuildOptions& options) {
  std::vector<Aabb> boxes(mesh.triangles.size());
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (const std::uint32_t corner : mesh.triangles[i]) boxes[i].extend(mesh.positions[corner]);
  const Topology binary = make_topology(boxes, options.leaf_size, LeafRule::fullest);
  WideTree tree;
  auto storage = std::make_shared<Storage>();
  if (!binary.nodes.empty()) {
    tree.root = binary.nodes[0].box;
    Collapse(mesh, binary, *storage, tree.stats).node(0, 1);
  }
  storage->leaves.resize(storage->leaves.size() + WideTree::kSlack);
  tree.nodes = storage->nodes;
  tree.leaves = storage->leaves;
  tree.stats.nodes = tree.nodes.size();
  tree.stats.bytes = tree.nodes.size_bytes() + tree.leaves.size_bytes();
  tree.storage = std::move(storage);
  return tree;
}

}  // namespace tessera

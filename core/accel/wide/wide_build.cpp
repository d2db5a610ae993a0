#include "core/accel/wide/wide_build.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "core/accel/wide/binary_builder.h"
#include "core/accel/wide/collapse.h"
#include "core/accel/wide/raw_array.h"
#include "core/accel/wide/wide_layout.h"
#include "core/accel/wide/work_crew.h"

namespace tessera {
namespace {

/// How much wide nodes and leaves take; and while they are laid out, where the next go.
struct Extent {
  std::uint64_t nodes = 0, words = 0, leaves = 0;
  std::uint32_t depth = 0;

  void add(const Extent& other) {
    nodes += other.nodes;
    words += other.words;
    leaves += other.leaves;
    depth = std::max(depth, other.depth);
  }
};

struct Storage {
  RawArray<WideNode> nodes;
  RawArray<std::uint32_t> leaves;
};

void check_words(std::uint64_t words) {
  if (words / 4 > WideChild::kMostQuads)
    throw std::length_error(
        "a mesh has more triangles than a wide hierarchy has room for: 2 GiB of leaves, 50 million");
}

/// A subtree that one thread lays out.
struct Job {
  std::uint32_t binary;  ///< Its root among the binary nodes,
  std::uint64_t wide;    ///< and among the wide ones.
  std::uint32_t depth;   ///< Levels down to its root, that included.
  Extent extent{};       ///< Of what lies below its root.
};

/// Collapses a binary tree into wide nodes, depth-first, siblings side by side: once to learn how much that takes, once
/// more to write it.
class Layout {
 public:
  /// Leaves of triangles are of `mesh`; where that is null they only have numbers.
  Layout(const TriangleMesh* mesh, const BinaryTree& binary, unsigned threads) : mesh_(mesh), binary_(binary) {
    Extent top{.nodes = 1, .depth = 1};
    lay_out(root(), top, &jobs_);
    for_each_index(jobs_.size(), threads, [&](std::size_t i) { lay_out(jobs_[i], jobs_[i].extent, nullptr); });
    extent_ = top;
    for (const Job& job : jobs_) extent_.add(job.extent);
    check_words(extent_.words);
    storage_ = std::make_shared<Storage>(
        Storage{RawArray<WideNode>(extent_.nodes), RawArray<std::uint32_t>(extent_.words + WideTree::kSlack)});
    std::vector<Extent> starts;
    Extent next = top;
    for (const Job& job : jobs_) {
      starts.push_back(next);
      next.add(job.extent);
    }
    top = {.nodes = 1};
    std::vector<Job> same;
    lay_out(root(), top, &same);
    for_each_index(jobs_.size(), threads, [&](std::size_t i) { lay_out(jobs_[i], starts[i], nullptr); });
    std::fill_n(storage_->leaves.data() + extent_.words, WideTree::kSlack, 0U);
  }

  WideTree tree() const {
    WideTree tree;
    tree.root = binary_.nodes[0].box().aabb();
    tree.nodes = {storage_->nodes.data(), extent_.nodes};
    tree.leaves = {storage_->leaves.data(), extent_.words + WideTree::kSlack};
    tree.stats = {.bytes = tree.nodes.size_bytes() + tree.leaves.size_bytes(),
                  .nodes = extent_.nodes,
                  .leaves = extent_.leaves,
                  .depth = extent_.depth};
    tree.storage = storage_;
    return tree;
  }

 private:
  static Job root() { return {.binary = 0, .wide = 0, .depth = 1}; }

  /// Lays out a node and what is below it, beginning at `next`. Subtrees of the top's nodes are left as jobs.
  void lay_out(const Job& at, Extent& next, std::vector<Job>* jobs) const {
    std::array<std::uint32_t, WideNode::kChildren> below{at.binary};
    const bool has_one_leaf = binary_.nodes[at.binary].is_leaf();
    const std::size_t count = has_one_leaf ? 1 : collapsed_children(binary_.nodes.data(), at.binary, below);
    std::array<std::uint32_t, WideNode::kChildren> children;
    const std::uint64_t first = next.nodes;
    next.depth = std::max(next.depth, at.depth);
    for (std::size_t i = 0; i < count; ++i)
      children[i] = binary_.nodes[below[i]].is_leaf() ? leaf(binary_.nodes[below[i]], next)
                                                      : static_cast<std::uint32_t>(next.nodes++);
    if (storage_) {
      std::array<Aabb, WideNode::kChildren> boxes;
      for (std::size_t i = 0; i < count; ++i) boxes[i] = binary_.nodes[below[i]].box().aabb();
      WideNode& node = storage_->nodes[at.wide];
      node = make_wide_node({boxes.data(), count});
      std::copy_n(children.begin(), count, node.child);
    }
    std::uint64_t wide = first;
    for (std::size_t i = 0; i < count; ++i) {
      const BinaryNode& child = binary_.nodes[below[i]];
      if (child.is_leaf()) continue;
      const Job job{.binary = below[i], .wide = wide++, .depth = at.depth + 1};
      if (jobs != nullptr && !child.is_top())
        jobs->push_back(job);
      else
        lay_out(job, next, jobs);
    }
  }

  std::uint32_t leaf(const BinaryNode& node, Extent& next) const {
    ++next.leaves;
    if (!mesh_) return WideChild::leaf(binary_.triangles[node.first()], 1);
    const std::uint64_t at = next.words;
    next.words += leaf_words(node.count());
    if (storage_)
      write_leaf(*mesh_, {binary_.triangles.data() + node.first(), node.count()}, storage_->leaves.data() + at);
    return WideChild::leaf(static_cast<std::uint32_t>(at / 4), node.count());
  }

  const TriangleMesh* mesh_;
  const BinaryTree& binary_;
  std::vector<Job> jobs_;
  Extent extent_;
  std::shared_ptr<Storage> storage_;  ///< Null as long as it is only measured.
};

/// Asked once, since that takes a system a while.
unsigned machine_threads() {
  static const unsigned threads = std::max(1U, std::thread::hardware_concurrency());
  return threads;
}

WideTree empty_tree() {
  auto slack = std::make_shared<std::array<std::uint32_t, WideTree::kSlack>>();
  WideTree tree;
  tree.leaves = *slack;
  tree.stats.bytes = tree.leaves.size_bytes();
  tree.storage = std::move(slack);
  return tree;
}

}  // namespace

WideTree build_wide(const TriangleMesh& mesh, const WideBuildOptions& options) {
  if (mesh.triangles.empty()) return empty_tree();
  check_words(std::uint64_t{10} * mesh.triangles.size());  // No leaf takes less, so it needn't be built to know.
  WideBuildOptions settled = options;
  if (settled.threads == 0) settled.threads = machine_threads();
  return Layout(&mesh, build_binary(mesh, settled), settled.threads).tree();
}

WideTree build_wide_over(std::span<const Aabb> boxes, unsigned threads) {
  if (boxes.size() > WideChild::kMostQuads)
    throw std::length_error("a scene has more objects than a wide hierarchy has room for: 134 million");
  // As a mesh of triangles with just those boxes.
  TriangleMesh stand_ins;
  std::vector<std::uint32_t> numbers;
  stand_ins.positions.reserve(2 * boxes.size());
  stand_ins.triangles.reserve(boxes.size());
  numbers.reserve(boxes.size());
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    if (boxes[i].empty()) continue;
    const auto corner = static_cast<std::uint32_t>(stand_ins.positions.size());
    stand_ins.positions.insert(stand_ins.positions.end(), {boxes[i].lo, boxes[i].hi});
    stand_ins.triangles.push_back({corner, corner + 1, corner});
    numbers.push_back(i);
  }
  if (numbers.empty()) return empty_tree();
  const WideBuildOptions options{
      .leaf_size = 1, .threads = threads == 0 ? machine_threads() : threads, .spatial_splits = false};
  BinaryTree binary = build_binary(stand_ins, options);
  for (std::size_t i = 0; i < numbers.size(); ++i) binary.triangles[i] = numbers[binary.triangles[i]];
  return Layout(nullptr, binary, options.threads).tree();
}

}  // namespace tessera

#include "core/accel/wide/binary_builder.h"

#include <algorithm>
#include <bit>
#include <memory>
#include <vector>

#include "core/accel/wide/binned_sah.h"
#include "core/accel/wide/collapse.h"
#include "core/accel/wide/work_crew.h"

namespace tessera {
namespace {

/// References that stand one after another, in one of the two halves of the builder's memory.
struct Range {
  std::uint32_t begin = 0, end = 0;
  int half = 0;
  LanesBox box = LanesBox::empty(), middles = LanesBox::empty();

  std::uint32_t count() const { return end - begin; }
};

/// A subtree to be built.
struct Subtree {
  Range range;
  std::uint32_t node;   ///< Its root.
  std::uint32_t space;  ///< Its other nodes stand from here on; twice as many as references are enough.
  std::uint32_t depth;  ///< Levels above it.
};

/// The top of the tree, of subtrees that are too large for one thread.
struct Part {
  Subtree subtree;
  SlotCosts costs{};
  std::unique_ptr<Part> left{}, right{};
};

class Builder {
 public:
  Builder(const TriangleMesh& mesh, std::uint32_t leaf_size, unsigned threads, BinaryTree& tree)
      : leaf_size_(leaf_size),
        refs_{Scratch<PrimitiveRef>(mesh.triangles.size()), Scratch<PrimitiveRef>(mesh.triangles.size())},
        tree_(tree) {
    Part root{{make_refs(mesh, threads), 0, 1, 0}};
    const Lanes size = root.subtree.range.box.hi - root.subtree.range.box.lo;
    unit_ = std::min(1 / std::max({size[0], size[1], size[2]}), 0x1p126F);
    TaskStack<Part*> parts;
    parts.push(&root);
    parts.run(threads, [&](Part* part) { build(*part, parts); });
    plan(root);
  }

 private:
  static constexpr std::uint32_t kBlock = 1 << 14;
  /// A subtree of so many references is one thread's task.
  static constexpr std::uint32_t kOneTask = 1 << 12;

  Range make_refs(const TriangleMesh& mesh, unsigned threads) {
    const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
    std::vector<Range> blocks((count + kBlock - 1) / kBlock);
    for_each_index(blocks.size(), threads, [&](std::size_t number) {
      Range block;
      block.begin = static_cast<std::uint32_t>(number) * kBlock;
      block.end = std::min(count, block.begin + kBlock);
      for (std::uint32_t i = block.begin; i < block.end; ++i) {
        LanesBox box = LanesBox::empty();
        for (const std::uint32_t corner : mesh.triangles[i]) {
          const Vec3& p = mesh.positions[corner];
          box.extend(Lanes{p.x, p.y, p.z, 0});
        }
        refs_[0][i] = PrimitiveRef::of(box, i);
        block.box.extend(box);
        block.middles.extend(refs_[0][i].middle());
      }
      blocks[number] = block;
    });
    Range all;
    all.end = count;
    for (const Range& block : blocks) {
      all.box.extend(block.box);
      all.middles.extend(block.middles);
    }
    return all;
  }

  void build(Part& part, TaskStack<Part*>& parts) {
    const Subtree& top = part.subtree;
    if (top.range.count() <= std::max(leaf_size_, kOneTask)) {
      Shelf shelf{top.space, top.range.begin};
      part.costs = build(top.node, top.range, top.depth, shelf);
      return;
    }
    Range left, right;
    split(top.range, top.depth, left, right);
    const std::uint32_t pair = top.space;
    part.left = std::make_unique<Part>(Part{{left, pair, pair + 2, top.depth + 1}});
    part.right = std::make_unique<Part>(Part{{right, pair + 1, pair + 2 * left.count(), top.depth + 1}});
    parts.push(part.left.get());
    parts.push(part.right.get());
  }

  void plan(Part& part) {
    if (!part.left) return;
    plan(*part.left);
    plan(*part.right);
    part.costs = join(part.subtree.node, part.subtree.range.box, part.subtree.space, part.left->costs,
                      part.right->costs, BinaryNode::kTop);
  }

  /// Where a thread puts what it makes next.
  struct Shelf {
    std::uint32_t node, triangle;
  };

  SlotCosts build(std::uint32_t node, const Range& range, std::uint32_t depth, Shelf& shelf) {
    if (range.count() <= leaf_size_) {
      tree_.nodes[node] = BinaryNode::leaf(range.box, shelf.triangle, range.count());
      for (std::uint32_t i = range.begin; i < range.end; ++i)
        tree_.triangles[shelf.triangle++] = refs_[range.half][i].triangle();
      return leaf_costs(half_area(range.box, unit_), range.count());
    }
    Range left, right;
    split(range, depth, left, right);
    const std::uint32_t pair = shelf.node;
    shelf.node += 2;
    const SlotCosts left_costs = build(pair, left, depth + 1, shelf);
    return join(node, range.box, pair, left_costs, build(pair + 1, right, depth + 1, shelf), 0);
  }

  SlotCosts join(std::uint32_t node, const LanesBox& box, std::uint32_t pair, const SlotCosts& left,
                 const SlotCosts& right, std::uint32_t mark) {
    std::uint32_t plan;
    const SlotCosts costs = inner_costs(half_area(box, unit_), left, right, plan);
    tree_.nodes[node] = BinaryNode::inner(box, pair, plan | mark);
    return costs;
  }

  void split(const Range& range, std::uint32_t depth, Range& left, Range& right) {
    // Coordinates made to defeat the heuristic end where there are just levels enough to halve what is left.
    const std::uint32_t levels_left = WideTree::kMostDepth - 1 - depth;
    if (static_cast<std::uint32_t>(std::bit_width(range.count())) < levels_left) {
      const BinGrid grid(range.middles, range.count());
      Bins bins(grid);
      bins.add({refs_[range.half].data() + range.begin, range.count()}, grid);
      const ObjectSplit best = bins.best_split(unit_);
      if (best.axis >= 0) return deal(range, grid, best, left, right);
    }
    halve(range, left, right);
  }

  /// References go to the other half of the memory in their order: so the tree doesn't depend on who deals, and no
  /// branch has to be guessed.
  void deal(const Range& range, const BinGrid& grid, const ObjectSplit& split, Range& left, Range& right) {
    const std::uint32_t middle = range.begin + split.left;
    left = {range.begin, middle, 1 - range.half, split.left_box, LanesBox::empty()};
    right = {middle, range.end, 1 - range.half, split.right_box, LanesBox::empty()};
    PrimitiveRef* to[2] = {refs_[1 - range.half].data() + range.begin, refs_[1 - range.half].data() + middle};
    const PrimitiveRef* from = refs_[range.half].data();
    const LanesBox none = LanesBox::empty();
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
      const PrimitiveRef& ref = from[i];
      const bool is_right = grid.is_right_of(ref, split.axis, split.bin);
      *to[is_right]++ = ref;
      const IntLanes goes_right = IntLanes{} - is_right;
      const Lanes at = ref.middle();
      left.middles.lo = min(left.middles.lo, goes_right ? none.lo : at);
      left.middles.hi = max(left.middles.hi, goes_right ? none.hi : at);
      right.middles.lo = min(right.middles.lo, goes_right ? at : none.lo);
      right.middles.hi = max(right.middles.hi, goes_right ? at : none.hi);
    }
  }

  void halve(const Range& range, Range& left, Range& right) {
    const std::uint32_t middle = range.begin + range.count() / 2;
    left = around(range.begin, middle, range.half);
    right = around(middle, range.end, range.half);
  }

  Range around(std::uint32_t begin, std::uint32_t end, int half) const {
    Range range{begin, end, half};
    for (std::uint32_t i = begin; i < end; ++i) {
      range.box.extend(refs_[half][i].box());
      range.middles.extend(refs_[half][i].middle());
    }
    return range;
  }

  std::uint32_t leaf_size_;
  Scratch<PrimitiveRef> refs_[2];
  BinaryTree& tree_;
  float unit_;
};

}  // namespace

BinaryTree build_binary(const TriangleMesh& mesh, std::uint32_t leaf_size, unsigned threads) {
  const std::size_t count = mesh.triangles.size();
  BinaryTree tree{Scratch<BinaryNode>(2 * count), Scratch<std::uint32_t>(count)};
  Builder(mesh, leaf_size, threads, tree);
  return tree;
}

}  // namespace tessera

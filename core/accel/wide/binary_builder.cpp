#include "core/accel/wide/binary_builder.h"

#include <algorithm>
#include <bit>
#include <memory>
#include <vector>

#include "core/accel/build_stop.h"
#include "core/accel/wide/binned_sah.h"
#include "core/accel/wide/collapse.h"
#include "core/accel/wide/primitive_refs.h"
#include "core/accel/wide/raw_array.h"
#include "core/accel/wide/spatial_split.h"
#include "core/accel/wide/triangle_corners.h"
#include "core/accel/wide/work_crew.h"

namespace tessera {
namespace {

/// References that stand one after another in one of the two halves of the builder's memory, and the room around them
/// in either half that is theirs.
struct Range {
  std::uint32_t begin = 0, end = 0;
  int half = 0;
  LanesBox box = LanesBox::empty(), middles = LanesBox::empty();
  std::uint32_t room_begin = 0, room_end = 0;

  std::uint32_t count() const { return end - begin; }
  std::uint32_t room() const { return room_end - room_begin; }
  void extend(const PrimitiveRef& ref) {
    box.extend(ref.box());
    middles.extend(ref.middle());
  }
};

/// A subtree to be built.
struct Subtree {
  Range range;
  std::uint32_t node;   ///< Its root.
  std::uint32_t space;  ///< Its other nodes stand from here on: fewer than two for each place in its room.
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
  Builder(const TriangleMesh& mesh, const WideBuildOptions& options, std::uint32_t room, BinaryTree& tree)
      : mesh_(mesh),
        options_(options),
        refs_{RawArray<PrimitiveRef>(room, Pages::small), RawArray<PrimitiveRef>(room, Pages::small)},
        tree_(tree) {
    Part root{{make_refs(), 0, 1, 0}};
    root.subtree.range.room_end = room;
    const Lanes size = root.subtree.range.box.hi - root.subtree.range.box.lo;
    unit_ = std::min(1 / std::max({size[0], size[1], size[2]}), 0x1p126F);
    TaskStack<Part*> parts;
    parts.push(&root);
    const std::uint32_t most_threads = 1 + room / kOneTask;
    parts.run(std::min(options.threads, most_threads), [&](Part* part) { build(*part, parts); });
    plan(root);
  }

 private:
  static constexpr std::uint32_t kBlock = 1 << 14;
  /// A subtree of so many references is one thread's task.
  static constexpr std::uint32_t kOneTask = 1 << 12;
  /// Nodes of fewer are many, and built in microseconds.
  static constexpr std::uint32_t kWorthChecking = 1 << 9;

  Range make_refs() {
    const auto count = static_cast<std::uint32_t>(mesh_.triangles.size());
    std::vector<Range> blocks((count + kBlock - 1) / kBlock);
    for_each_index(blocks.size(), options_.threads, [&](std::size_t number) {
      Range block;
      block.begin = static_cast<std::uint32_t>(number) * kBlock;
      block.end = std::min(count, block.begin + kBlock);
      for (const RawArray<PrimitiveRef>& half : refs_) half.fetch(block.begin, block.end);
      for (std::uint32_t i = block.begin; i < block.end; ++i) {
        LanesBox box = LanesBox::empty();
        for (const Lanes corner : corners_of(mesh_, i)) box.extend(corner);
        refs_[0][i] = PrimitiveRef::of(box, i);
        block.extend(refs_[0][i]);
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
    if (top.range.count() <= kOneTask) {
      Shelf shelf{top.space, top.range.room_begin};
      part.costs = build(top.node, top.range, top.depth, shelf);
      return;
    }
    Range left, right;
    split(top.range, top.depth, left, right);
    const std::uint32_t pair = top.space;
    part.left = std::make_unique<Part>(Part{{left, pair, pair + 2, top.depth + 1}});
    part.right = std::make_unique<Part>(Part{{right, pair + 1, pair + 2 * left.room(), top.depth + 1}});
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
    if (range.count() <= options_.leaf_size) {
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
    if (range.count() >= kWorthChecking) BuildStop::check();
    // Coordinates made to defeat the heuristic end where there are just levels enough to halve what is left.
    const std::uint32_t levels_left = WideTree::kMostDepth - 1 - depth;
    if (static_cast<std::uint32_t>(std::bit_width(range.count())) >= levels_left) return halve(range, left, right);
    const std::span<const PrimitiveRef> refs = refs_of(range);
    const BinGrid grid(range.middles, range.count());
    const Split best = bin_middles(refs, grid).best_split(range.count(), unit_);
    if (best.axis < 0) return halve(range, left, right);
    if (options_.spatial_splits && promises_spatial_split(refs, range.box, best, unit_)) {
      const SpatialSplit spatial = best_spatial_split(mesh_, refs, range.box, unit_);
      if (spatial.split.cost < best.cost && cut(range, spatial, left, right)) return;
    }
    deal(range, grid, best, left, right);
  }

  /// References go to the other half of the memory in their order: so the tree doesn't depend on who deals, and no
  /// branch has to be guessed.
  void deal(const Range& range, const BinGrid& grid, const Split& split, Range& left, Range& right) {
    left = right = {.half = 1 - range.half};
    share_room(range, split.left, split.right, left, right);
    left.begin = left.end = left.room_begin;
    right.begin = right.end = right.room_begin;
    left.end += split.left;
    right.end += split.right;
    left.box = split.left_box;
    right.box = split.right_box;
    PrimitiveRef* to_left = refs_[left.half].data() + left.begin;
    PrimitiveRef* to_right = refs_[right.half].data() + right.begin;
    LanesBox left_middles = LanesBox::empty(), right_middles = LanesBox::empty();
    const LanesBox none = LanesBox::empty();
    for (const PrimitiveRef& ref : refs_of(range)) {
      const IntLanes goes_right = grid.is_right_of(ref, split.axis, split.bin);
      const bool is_right = goes_right[0];
      *(is_right ? to_right : to_left) = ref;
      to_right += is_right;
      to_left += !is_right;
      const Lanes at = ref.middle();
      left_middles.lo = min(left_middles.lo, goes_right ? none.lo : at);
      left_middles.hi = max(left_middles.hi, goes_right ? none.hi : at);
      right_middles.lo = min(right_middles.lo, goes_right ? at : none.lo);
      right_middles.hi = max(right_middles.hi, goes_right ? at : none.hi);
    }
    left.middles = left_middles;
    right.middles = right_middles;
  }

  /// Deals by a plane that cuts references, unless leaving one whole is cheaper, or there is no room left. False, and
  /// nothing done, where one side would be empty.
  bool cut(const Range& range, const SpatialSplit& spatial, Range& left, Range& right) {
    const auto& [split, plane] = spatial;
    left = right = {.half = 1 - range.half};
    left.begin = left.end = range.room_begin;
    right.begin = right.end = range.room_end;
    PrimitiveRef* to = refs_[left.half].data();
    const auto put_left = [&](const PrimitiveRef& ref) {
      to[left.end++] = ref;
      left.extend(ref);
    };
    const auto put_right = [&](const PrimitiveRef& ref) {
      to[--right.begin] = ref;
      right.extend(ref);
    };
    std::uint32_t spare = range.room() - range.count();
    Reunion reunion(split, unit_);
    for (const PrimitiveRef& ref : refs_of(range)) {
      if (ref.hi[split.axis] <= plane) {
        put_left(ref);
      } else if (ref.lo[split.axis] >= plane) {
        put_right(ref);
      } else {
        const RefCut parts(mesh_, ref, split.axis, plane);
        const Side side = parts.left.is_empty()    ? Side::right
                          : parts.right.is_empty() ? Side::left
                                                   : reunion.side_of(ref, spare > 0);
        if (side == Side::both) --spare;
        if (side != Side::right) put_left(side == Side::both ? PrimitiveRef::of(parts.left, ref.triangle()) : ref);
        if (side != Side::left) put_right(side == Side::both ? PrimitiveRef::of(parts.right, ref.triangle()) : ref);
      }
    }
    if (left.count() == 0 || right.count() == 0) return false;
    share_room(range, left.count(), right.count(), left, right);
    return true;
  }

  void halve(const Range& range, Range& left, Range& right) {
    const std::uint32_t middle = range.begin + range.count() / 2;
    left = around(range.begin, middle, range.half);
    right = around(middle, range.end, range.half);
    left.room_begin = range.room_begin;
    left.room_end = right.room_begin = middle;
    right.room_end = range.room_end;
  }

  std::span<const PrimitiveRef> refs_of(const Range& range) const {
    return {refs_[range.half].data() + range.begin, range.count()};
  }

  Range around(std::uint32_t begin, std::uint32_t end, int half) const {
    Range range{begin, end, half};
    for (std::uint32_t i = begin; i < end; ++i) range.extend(refs_[half][i]);
    return range;
  }

  /// Room that is left over is shared by number.
  static void share_room(const Range& range, std::uint32_t lefts, std::uint32_t rights, Range& left, Range& right) {
    const std::uint64_t spare = range.room() - lefts - rights;
    left.room_begin = range.room_begin;
    left.room_end = right.room_begin =
        range.room_begin + lefts + static_cast<std::uint32_t>(spare * lefts / (std::uint64_t{lefts} + rights));
    right.room_end = range.room_end;
  }

  const TriangleMesh& mesh_;
  const WideBuildOptions& options_;
  RawArray<PrimitiveRef> refs_[2];
  BinaryTree& tree_;
  float unit_;
};

}  // namespace

BinaryTree build_binary(const TriangleMesh& mesh, const WideBuildOptions& options) {
  const std::size_t count = mesh.triangles.size();
  const std::size_t room = options.spatial_splits ? count + count * 3 / 10 : count;
  // Leaves of several triangles leave most of the room for nodes empty.
  BinaryTree tree{RawArray<BinaryNode>(2 * room, Pages::small), RawArray<std::uint32_t>(room, Pages::small)};
  Builder(mesh, options, static_cast<std::uint32_t>(room), tree);
  return tree;
}

}  // namespace tessera

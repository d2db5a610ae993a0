// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_RAY_STREAM_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_RAY_STREAM_INL
#undef TESSERA_RAY_STREAM_INL
#else
#define TESSERA_RAY_STREAM_INL
#endif

#include <vector>

#include "core/accel/tally.h"
#include "core/accel/wide/exact-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {

/// Many rays' way through a tree together, node by node (after Barringer & Akenine-Möller, "Dynamic Ray Stream
/// Traversal", 2014): each node is looked into once for all the rays that enter it, one ray after the other against its
/// eight children. A single ray waits at each node for the last one's answer; here nothing waits for anything, and that
/// is worth more than what two rays have in common.
///
/// Rays of one octant go together, so that they agree on which planes are near, and on an order of the children.
template <typename Counter, typename OnHit>
class RayStream {
 public:
  /// `on_hit(ray, t, triangle)` is called for hits within the ray's interval at t ≤ limits[ray]; it returns the new
  /// limit, or `kStop`. Rays that start with `kStop` aren't traced.
  RayStream(const WideTree& tree, std::span<const Ray> rays, std::span<float> limits, Counter tally, OnHit on_hit)
      : tree_(tree), frame_(tree), rays_(rays), limits_(limits), tally_(tally), on_hit_(on_hit) {}

  /// The octants take turns, a list at a time: what one has asked memory for arrives while the others are served.
  HWY_INLINE void run() {
    setup();
    for (bool any = true; any;) {
      any = false;
      for (std::uint32_t octant = 0; octant < 8; ++octant) {
        Group& group = groups_[octant];
        if (group.lists.empty()) continue;
        any = true;
        const List list = group.lists.back();
        group.lists.pop_back();
        if (WideChild::is_leaf(list.child))
          visit_leaf(group, list);
        else
          visit_node(group, list, octant);
      }
    }
    test_queued();
  }

 private:
  struct List {
    std::uint32_t child;
    std::uint32_t first, count;  ///< Into `members`.
  };

  /// The rays of an octant.
  struct Group {
    std::vector<List> lists;             ///< To be visited, the last first.
    std::vector<std::uint32_t> members;  ///< Rays of the lists, one list after the other.
  };

  HWY_INLINE void setup() {
    clip_.resize(rays_.size());
    leaf_rays_.resize(rays_.size());
    for (std::uint32_t i = 0; i < rays_.size(); ++i) {
      if (limits_[i] == kStop) continue;
      clip_[i] = ClipRay(frame_, rays_[i]);
      leaf_rays_[i] = LeafRay(rays_[i], clip_[i]);
      groups_[octant_of(rays_[i].direction)].members.push_back(i);
    }
    for (Group& group : groups_)
      if (!group.members.empty()) group.lists.push_back({0, 0, static_cast<std::uint32_t>(group.members.size())});
  }

  HWY_INLINE void visit_node(Group& group, const List& list, std::uint32_t octant) {
    const WideNode& node = tree_.nodes[list.child];
    const PlaneRows rows(octant);
    const std::size_t end = list.first + list.count;
    group.members.resize(std::max(group.members.size(), end + 8 * (list.count + kSlack)));
    entered_.resize(std::max(entered_.size(), std::size_t{list.count} + kSlack));
    for (std::size_t first = 0; first < 8; first += kLanes8) {
      const ChildPlanes planes(node, first, rows, frame_);
      for (std::size_t i = 0; i < list.count; ++i) {
        const std::uint32_t ray = group.members[list.first + i];
        hn::Vec<F8> enter;
        const std::uint32_t missed = bits_of(F8(), planes.missed_by(clip_[ray], limits_[ray], enter));
        const std::uint32_t entered = (~missed & ((1U << kLanes8) - 1)) << first;
        entered_[i] = first == 0 ? entered : entered_[i] | entered;
      }
    }
    distribute(group, list, node, far_to_near(node, octant));
  }

  /// Lists the rays that enter each child.
  HWY_INLINE void distribute(Group& group, const List& list, const WideNode& node, std::uint32_t order) {
    const hn::CappedTag<std::uint32_t, 16> u;
    constexpr std::size_t kLanes = hn::MaxLanes(u);
    std::uint32_t* members = group.members.data();
    std::uint32_t at = list.first + list.count;
    for (int i = 0; i < 8; ++i, order >>= 3) {
      const std::uint32_t slot = order & 7, child = node.child[slot];
      if (child == kNoChild) continue;
      const std::uint32_t begin = at;
      for (std::size_t k = 0; k < list.count; k += kLanes) {
        const auto entered = hn::TestBit(hn::LoadU(u, entered_.data() + k), hn::Set(u, 1U << slot));
        const auto valid = hn::And(entered, hn::FirstN(u, list.count - k));
        hn::StoreU(hn::Compress(hn::LoadU(u, members + list.first + k), valid), u, members + at);
        at += static_cast<std::uint32_t>(hn::CountTrue(u, valid));
      }
      tally_.volumes(list.count, at - begin);
      if (at == begin) continue;
      group.lists.push_back({child, begin, at - begin});
      prefetch(tree_, child);
    }
  }

  HWY_INLINE void visit_leaf(const Group& group, const List& list) {
    const Leaf leaf(tree_, list.child);
    for (std::size_t k = 0; k < list.count; ++k) {
      const std::uint32_t ray = group.members[list.first + k];
      const LeafRay& culling = leaf_rays_[ray];
      std::uint32_t possible = 0;
      for (std::size_t first = 0; first < leaf.count; first += kLanes8)
        possible |= culling.possible(leaf, first, limits_[ray]) << first;
      const auto before = tally_.hits();
      for (; possible != 0; possible &= possible - 1) {
        queue_.add(ray, rays_[ray], culling.axes, leaf, static_cast<std::size_t>(std::countr_zero(possible)));
        if (queue_.full()) test_queued();
      }
      if constexpr (Counter::kCounts) {  // which asks whether this very leaf was worth it
        test_queued();
        tally_.looked_into(before);
      }
    }
  }

  HWY_INLINE void test_queued() {
    queue_.empty(tally_, [&](std::uint32_t ray, float t, std::uint32_t triangle) HWY_ATTR {
      if (t <= limits_[ray]) limits_[ray] = on_hit_(ray, t, triangle);
    });
  }

  static constexpr std::size_t kSlack = 16;

  const WideTree& tree_;
  const TreeFrame frame_;
  const std::span<const Ray> rays_;
  const std::span<float> limits_;
  const Counter tally_;
  OnHit on_hit_;
  std::vector<ClipRay> clip_;
  std::vector<LeafRay> leaf_rays_;
  Group groups_[8];
  ExactQueue queue_;
  std::vector<std::uint32_t> entered_;  ///< For each ray of the list at hand, which children it enters: bits.
};

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

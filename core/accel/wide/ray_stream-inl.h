// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_RAY_STREAM_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_RAY_STREAM_INL
#undef TESSERA_RAY_STREAM_INL
#else
#define TESSERA_RAY_STREAM_INL
#endif

#include <memory>
#include <vector>

#include "core/accel/tally.h"
#include "core/accel/wide/exact-inl.h"
#include "core/accel/wide/wide_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {

/// Rays to a list up to which each goes on alone: measured on meshes of 60,000 to 2 million triangles.
inline constexpr std::size_t kFewInList = 2;

/// What a stream works with.
struct StreamMemory {
  using U16 = hn::CappedTag<std::uint32_t, 16>;
  static constexpr std::size_t kLanes = hn::MaxLanes(U16());

  struct List {
    std::uint32_t child;
    std::uint32_t first, count;  ///< Into `rays`.
    float entry = -kInfinity;    ///< Where a ray that is alone enters it.
  };

  /// The rays of an octant.
  struct Group {
    int waiting = 0;
    List lists[WideTree::kMostDepth * 7 + 8 * (kFewInList + 1)];  ///< To be visited, the last first.
    std::vector<std::uint32_t> rays;                              ///< Of the lists, one list after the other.
  };

  Group groups[8];
  SearchRay search[kStreamRays];
  std::uint32_t bits[kStreamRays + kLanes];  ///< For each ray of a list, which children or triangles it may hit.
};

/// Many rays' way through a tree together, node by node (after Barringer & Akenine-Möller, "Dynamic Ray Stream
/// Traversal", 2014): each node is looked into once for all the rays that enter it, one ray after the other against its
/// eight children. A single ray waits at each node for the last one's answer; here nothing waits for anything, and that
/// is worth more than what two rays have in common. So rays stay in their stream when few are left together, but go on
/// alone.
///
/// Rays of one octant go together, so that they agree on which planes are near, and on an order of the children.
///
/// In a tree over bodies a leaf is one of them, and `on_test(body, rays)` is called with the numbers of those that may
/// enter it; it lowers their limits.
template <typename Counter, typename OnTest, bool kOverBodies = false>
class RayStream {
 public:
  /// `on_test(ray, is_hit, t, triangle, limits[ray])` is called for what is tested: whether it is hit within the ray's
  /// interval, and where, perhaps beyond the limit. It returns the new limit, or `kStop`. Rays that start with `kStop`
  /// aren't traced. Precondition: at most `kStreamRays`.
  RayStream(StreamMemory& memory, const WideTree& tree, std::uint32_t object, std::span<const Ray> rays,
            std::span<float> limits, Counter tally, OnTest on_test, Transform::Error placed = {})
      : groups_(memory.groups),
        search_(memory.search),
        bits_(memory.bits),
        tree_(tree),
        object_(object),
        frame_(tree),
        rays_(rays),
        limits_(limits),
        tally_(tally),
        on_test_(on_test),
        placed_(placed),
        queue_(tree, rays) {}

  /// The octants take turns, a list at a time: what one has asked memory for arrives while the others are served.
  HWY_INLINE void run() {
    begin();
    for (bool any = true; any;) {
      any = false;
      for (std::uint32_t octant = 0; octant < 8; ++octant) {
        Group& group = groups_[octant];
        if (group.waiting == 0) continue;
        any = true;
        const List list = group.lists[--group.waiting];
        if (list.entry > limits_[group.rays[list.first]]) continue;
        if (WideChild::is_leaf(list.child) && kOverBodies)
          visit_body(group, list);
        else if (WideChild::is_leaf(list.child))
          visit_leaf(group, list);
        else if (list.count <= kFewInList)
          visit_node_alone(group, list, octant);
        else
          visit_node(group, list, octant);
      }
    }
    if constexpr (!kOverBodies) test_queued();
  }

 private:
  using List = StreamMemory::List;
  using Group = StreamMemory::Group;
  using U16 = StreamMemory::U16;
  static constexpr std::size_t kLanes = StreamMemory::kLanes;

  HWY_INLINE void begin() {
    for (Group& group : groups_) {
      group.waiting = 0;
      if (group.rays.size() < rays_.size() + kLanes) group.rays.resize(rays_.size() + kLanes);
    }
    const hn::CappedTag<float, 16> f;
    std::uint32_t counts[8] = {};
    alignas(64) std::uint32_t octants[hn::MaxLanes(f)];
    for (std::size_t first = 0; first < rays_.size(); first += hn::MaxLanes(f)) {
      set_up(f, frame_, object_, rays_, first, search_, octants);
      for (std::size_t i = first; i < std::min(first + hn::MaxLanes(f), rays_.size()); ++i) {
        if constexpr (kOverBodies) pad_for(frame_, rays_[i].origin, placed_, search_[i]);
        const std::uint32_t octant = octants[i - first];
        groups_[octant].rays[counts[octant]] = static_cast<std::uint32_t>(i);
        counts[octant] += limits_[i] != kStop;
      }
    }
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
      Group& group = groups_[octant];
      if (counts[octant] != 0) group.lists[group.waiting++] = {0, 0, counts[octant]};
    }
  }

  HWY_INLINE void visit_node(Group& group, const List& list, std::uint32_t octant) {
    const WideNode& node = tree_.nodes[list.child];
    const PlaneRows rows(octant);
    const std::uint32_t* members = group.rays.data() + list.first;
    std::uint32_t any = 0;
    for (std::size_t first = 0; first < 8; first += kLanes8) {
      const ChildPlanes planes(node, first, rows, frame_);
      for (std::size_t i = 0; i < list.count; ++i) {
        const std::uint32_t ray = members[i];
        hn::Vec<F8> enter;
        const std::uint32_t missed = bits_of(F8(), planes.missed_by(search_[ray], limits_[ray], enter));
        const std::uint32_t entered = (~missed & ((1U << kLanes8) - 1)) << first;
        bits_[i] = first == 0 ? entered : bits_[i] | entered;
        any |= entered;
      }
    }
    if (any != 0) distribute(group, list, node, far_to_near(node, octant));
  }

  /// Each ray of a short list goes on alone, with where it enters what, so that it turns away from what lies behind its
  /// hit. Its lists name the place that its number stands in already.
  HWY_INLINE void visit_node_alone(Group& group, const List& list, std::uint32_t octant) {
    const WideNode& node = tree_.nodes[list.child];
    const PlaneRows rows(octant);
    for (std::uint32_t i = list.first; i < list.first + list.count; ++i) {
      const std::uint32_t ray = group.rays[i];
      std::uint32_t child[8];
      float entry[8];
      const int count = enter_children(node, octant, rows, frame_, search_[ray], limits_[ray], child, entry);
      tally_.volumes(WideNode::kChildren, static_cast<std::uint64_t>(count));
      for (int k = 0; k < count; ++k) {
        group.lists[group.waiting++] = {child[k], i, 1, entry[k]};
        ask_for(child[k]);
      }
    }
  }

  /// Lists the rays that enter each child. No branch depends on which do.
  HWY_INLINE void distribute(Group& group, const List& list, const WideNode& node, std::uint32_t order) {
    const U16 u;
    const std::size_t room = list.first + 9 * (std::size_t{list.count} + kLanes);
    if (group.rays.size() < room) group.rays.resize(2 * room);
    std::uint32_t* rays = group.rays.data();
    std::uint32_t at = list.first + list.count;
    const int before = group.waiting;
    for (int i = 0; i < 8; ++i, order >>= 3) {
      const std::uint32_t slot = order & 7, child = node.child[slot];
      const auto bit = hn::Set(u, child == kNoChild ? 0 : 1U << slot);
      const std::uint32_t begin = at;
      for (std::uint32_t k = 0; k < list.count; k += kLanes) {
        const auto entered = hn::Ne(hn::And(hn::LoadU(u, bits_ + k), bit), hn::Zero(u));
        const auto valid = hn::And(entered, hn::FirstN(u, list.count - k));
        hn::StoreU(compress(u, hn::LoadU(u, rays + list.first + k), valid), u, rays + at);
        at += static_cast<std::uint32_t>(hn::CountTrue(u, valid));
      }
      tally_.volumes(list.count, at - begin);
      group.lists[group.waiting] = {child, begin, at - begin};
      group.waiting += at != begin;
    }
    for (int i = before; i < group.waiting; ++i) ask_for(group.lists[i].child);
  }

  HWY_INLINE void ask_for(std::uint32_t child) const {
    if (!(kOverBodies && WideChild::is_leaf(child))) prefetch(tree_, child);
  }

  /// All rays are culled before any is queued: a branch right after a ray's test would be guessed, often wrongly, while
  /// the test is under way. Limits may fall in between; culling by an older one only leaves more to test.
  HWY_INLINE void visit_leaf(const Group& group, const List& list) {
    const Leaf leaf(tree_, list.child);
    const std::uint32_t* const members = group.rays.data() + list.first;
    for (std::size_t first = 0; first < leaf.count; first += kLanes8) {
      const LeafTriangles triangles(leaf, first);
      for (std::size_t k = 0; k < list.count; ++k) {
        const std::uint32_t ray = members[k];
        const std::uint32_t possible = triangles.possible(rays_[ray], search_[ray], limits_[ray]) << first;
        bits_[k] = first == 0 ? possible : bits_[k] | possible;
      }
    }
    for (std::size_t k = 0; k < list.count; ++k) {
      const auto before = tally_.hits();
      const std::uint32_t ray = members[k];
      for (std::uint32_t possible = bits_[k]; possible != 0; possible &= possible - 1) {
        queue_.add(ray, search_[ray].axis, leaf, static_cast<std::size_t>(std::countr_zero(possible)));
        if (queue_.full()) test_queued();
      }
      if constexpr (Counter::kCounts) {  // which asks whether this very leaf was worth it
        test_queued();
        tally_.looked_into(before);
      }
    }
  }

  HWY_INLINE void visit_body(const Group& group, const List& list) {
    if constexpr (kOverBodies) {
      const auto before = tally_.hits();
      on_test_(WideChild::at(list.child), std::span(group.rays.data() + list.first, list.count));
      tally_.looked_into(before);
    }
  }

  HWY_INLINE void test_queued() {
    if constexpr (!kOverBodies)
      queue_.empty(tally_, [&](std::size_t ray, bool is_hit, float t, std::uint32_t triangle)
                               HWY_ATTR { limits_[ray] = on_test_(ray, is_hit, t, triangle, limits_[ray]); });
  }

  Group (&groups_)[8];
  SearchRay (&search_)[kStreamRays];
  std::uint32_t (&bits_)[kStreamRays + kLanes];
  const WideTree& tree_;
  const std::uint32_t object_;
  const TreeFrame frame_;
  const std::span<const Ray> rays_;
  const std::span<float> limits_;
  const Counter tally_;
  OnTest on_test_;
  const Transform::Error placed_;
  ExactQueue queue_;
};

/// Each thread's, which it keeps: asked for anew with every batch, it costs threads other than the first a page fault
/// for each of its pages. Small batches touch little of it.
inline StreamMemory& stream_memory() {
  static thread_local const auto memory = std::make_unique_for_overwrite<StreamMemory>();
  return *memory;
}

/// A thread's for trees over bodies, while the other is in use for one of these.
inline StreamMemory& body_stream_memory() {
  static thread_local const auto memory = std::make_unique_for_overwrite<StreamMemory>();
  return *memory;
}

/// Traces rays in streams of the size that fits.
template <typename Counter, typename OnTest>
HWY_INLINE void stream_rays(const WideTree& tree, std::uint32_t object, std::span<const Ray> rays,
                            std::span<float> limits, Counter tally, OnTest&& on_test) {
  StreamMemory& memory = stream_memory();
  for (std::size_t first = 0; first < rays.size(); first += kStreamRays) {
    const std::size_t count = std::min(kStreamRays, rays.size() - first);
    const auto shifted = [&](std::size_t ray, bool is_hit, float t, std::uint32_t triangle, float limit)
                             HWY_ATTR { return on_test(first + ray, is_hit, t, triangle, limit); };
    using Stream = RayStream<Counter, decltype(shifted)>;
    Stream(memory, tree, object, rays.subspan(first, count), limits.subspan(first, count), tally, shifted).run();
  }
}

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

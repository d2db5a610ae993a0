// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_SINGLE_RAY_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SINGLE_RAY_INL
#undef TESSERA_SINGLE_RAY_INL
#else
#define TESSERA_SINGLE_RAY_INL
#endif

#include "core/accel/tally.h"
#include "core/accel/wide/leaf-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {

/// One ray's way through a tree, nearest child first (Fuetterling et al. 2017): the children that it enters are put on
/// the stack all at once, in the order that the node keeps for the ray's octant, farthest first. No sorting, and no
/// branch that depends on how many there are.
class SingleRay {
 public:
  SingleRay(const WideTree& tree, const TreeFrame& frame, const Ray& ray)
      : tree_(tree),
        frame_(frame),
        ray_(ray),
        clip_(frame, ray),
        leaf_ray_(ray, clip_),
        octant_(octant_of(ray.direction)),
        rows_(octant_) {}

  /// Calls `hit(t, triangle)` for hits within the ray's interval at t ≤ limit; it returns the new limit, or `kStop`.
  template <typename Counter, typename OnHit>
  HWY_INLINE void visit(float limit, Counter tally, OnHit&& hit) {
    std::uint32_t current = 0;
    while (true) {
      if (!WideChild::is_leaf(current)) {
        const int before = top_;
        push_children(tree_.nodes[current], limit);
        tally.volumes(WideNode::kChildren, static_cast<std::uint64_t>(top_ - before));
      } else {
        const auto before = tally.hits();
        limit = test_leaf(Leaf(tree_, current), ray_, leaf_ray_, limit, tally, hit);
        if (limit == kStop) return;
        tally.looked_into(before);
      }
      do {
        if (top_ == 0) return;
        --top_;
      } while (entry_[top_] > limit);
      current = child_[top_];
    }
  }

 private:
  HWY_INLINE void push_children(const WideNode& node, float limit) {
    const F8 f;
    const U8 u;
    std::uint32_t order = far_to_near(node, octant_);
    [[maybe_unused]] std::uint32_t children[8];
    [[maybe_unused]] float entries[8];
    for (std::size_t first = 0; first < 8; first += kLanes8) {
      hn::Vec<F8> enter;
      const auto missed = ChildPlanes(node, first, rows_, frame_).missed_by(clip_, limit, enter);
      const auto entered =
          hn::IfThenElse(hn::RebindMask(u, missed), hn::Set(u, kNoChild), hn::LoadU(u, node.child + first));
      if constexpr (kLanes8 == 8) {
        alignas(32) static constexpr std::uint32_t kShifts[8] = {0, 3, 6, 9, 12, 15, 18, 21};
        const auto at = hn::And(hn::Shr(hn::Set(u, order), hn::Load(u, kShifts)), hn::Set(u, 7));
        const auto sorted = hn::TableLookupLanes(entered, hn::IndicesFromVec(u, at));
        const auto kept = hn::Ne(sorted, hn::Set(u, kNoChild));
        const auto sorted_enter = hn::TableLookupLanes(enter, hn::IndicesFromVec(f, at));
        hn::StoreU(hn::Compress(sorted, kept), u, child_ + top_);
        hn::StoreU(hn::Compress(sorted_enter, hn::RebindMask(f, kept)), f, entry_ + top_);
        top_ += static_cast<int>(hn::CountTrue(u, kept));
      } else {
        hn::StoreU(entered, u, children + first);
        hn::StoreU(enter, f, entries + first);
      }
    }
    if constexpr (kLanes8 < 8)
      for (int i = 0; i < 8; ++i, order >>= 3) {
        child_[top_] = children[order & 7];
        entry_[top_] = entries[order & 7];
        top_ += child_[top_] != kNoChild;
      }
  }

  const WideTree& tree_;
  const TreeFrame& frame_;
  const Ray& ray_;
  ClipRay clip_;
  LeafRay leaf_ray_;
  std::uint32_t octant_;
  PlaneRows rows_;
  int top_ = 0;
  std::uint32_t child_[WideTree::kMostDepth * 7 + 8];
  float entry_[WideTree::kMostDepth * 7 + 8];
};

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

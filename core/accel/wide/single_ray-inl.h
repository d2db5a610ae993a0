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

/// One ray's way through a tree, nearest child first.
class SingleRay {
 public:
  /// For a tree over bodies, of which some are `placed`.
  SingleRay(const WideTree& tree, const TreeFrame& frame, Transform::Error placed, const Ray& ray)
      : SingleRay(tree, frame, kNoPrimitive.object, ray) {
    pad_for(frame, ray.origin, placed, search_);
  }
  SingleRay(const WideTree& tree, const TreeFrame& frame, std::uint32_t object, const Ray& ray)
      : tree_(tree), frame_(frame), ray_(ray), octant_(set_up(frame, object, ray, search_)), rows_(octant_) {}

  /// Calls `hit(t, triangle)` for hits within the ray's interval at t ≤ limit; it returns the new limit, or `kStop`.
  template <typename Counter, typename OnHit>
  HWY_INLINE void visit(float limit, Counter tally, OnHit&& hit) {
    visit_leaves(limit, tally, [&](std::uint32_t leaf, float before) HWY_ATTR {
      return test_leaf(Leaf(tree_, leaf), ray_, search_, before, tally, hit);
    });
  }

  /// Calls `test(leaf, limit)` for the leaves that the ray may enter at t ≤ limit; it returns the new limit, or
  /// `kStop`.
  template <typename Counter, typename OnLeaf>
  HWY_INLINE void visit_leaves(float limit, Counter tally, OnLeaf&& test) {
    std::uint32_t current = 0;
    while (true) {
      if (!WideChild::is_leaf(current)) {
        const int entered =
            enter_children(tree_.nodes[current], octant_, rows_, frame_, search_, limit, child_ + top_, entry_ + top_);
        tally.volumes(WideNode::kChildren, static_cast<std::uint64_t>(entered));
        top_ += entered;
      } else {
        const auto before = tally.hits();
        limit = test(current, limit);
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
  const WideTree& tree_;
  const TreeFrame& frame_;
  const Ray& ray_;
  SearchRay search_;
  std::uint32_t octant_;
  PlaneRows rows_;
  int top_ = 0;
  std::uint32_t child_[WideTree::kMostDepth * 7 + 8];
  float entry_[WideTree::kMostDepth * 7 + 8];
};

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

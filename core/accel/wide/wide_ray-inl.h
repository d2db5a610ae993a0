// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_WIDE_RAY_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_WIDE_RAY_INL
#undef TESSERA_WIDE_RAY_INL
#else
#define TESSERA_WIDE_RAY_INL
#endif

#include <bit>
#include <cstddef>
#include <cstring>

#include <hwy/highway.h>

#include "core/accel/index.h"
#include "core/accel/wide/compress-inl.h"
#include "core/accel/wide/mask-inl.h"
#include "core/accel/wide/search_ray-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Lanes for a node's children and a leaf's triangles: eight where the machine has them, otherwise a part at a time.
using F8 = hn::CappedTag<float, 8>;
using U8 = hn::Rebind<std::uint32_t, F8>;
inline constexpr std::size_t kLanes8 = hn::MaxLanes(F8());

/// A row of a node's planes along an axis, relative to the centre.
HWY_INLINE hn::Vec<F8> planes(const WideNode& node, std::size_t row, int axis, const TreeFrame& frame) {
  const F8 f;
  const hn::Rebind<std::uint8_t, F8> bytes;
  const hn::Rebind<std::int32_t, F8> whole;
  const auto lattice = hn::LoadU(bytes, reinterpret_cast<const std::uint8_t*>(&node) + row);
  return hn::MulAdd(hn::ConvertTo(f, hn::PromoteTo(whole, lattice)), hn::Set(f, node.step[axis]),
                    hn::Set(f, node.origin[axis] - frame.center[axis]));
}

/// The rows of a node's nearer planes for rays of one octant, and of its farther ones.
struct PlaneRows {
  HWY_INLINE explicit PlaneRows(std::uint32_t octant) {
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const bool down = octant >> axis & 1;
      near[axis] = (down ? offsetof(WideNode, hi) : offsetof(WideNode, lo)) + WideNode::kChildren * axis;
      far[axis] = (down ? offsetof(WideNode, lo) : offsetof(WideNode, hi)) + WideNode::kChildren * axis;
    }
  }
  std::size_t near[3], far[3];
};

/// The planes of some of a node's children, relative to the centre.
struct ChildPlanes {
  HWY_INLINE ChildPlanes(const WideNode& node, std::size_t first, const PlaneRows& rows, const TreeFrame& frame) {
    for (int axis = 0; axis < 3; ++axis) {
      near[axis] = planes(node, rows.near[axis] + first, axis, frame);
      far[axis] = planes(node, rows.far[axis] + first, axis, frame);
    }
  }

  /// Which of them the ray misses before `limit`, and where it enters them. Where one of two is NaN, x86 takes the
  /// second and arm64 NaN; a comparison with NaN is false, and so misses nothing.
  HWY_INLINE hn::Mask<F8> missed_by(const SearchRay& ray, float limit, hn::Vec<F8>& enter) const {
    const F8 f;
    const auto at = [&](const hn::Vec<F8>& plane, int axis, float start)
                        HWY_ATTR { return hn::MulAdd(plane, hn::Set(f, ray.inverse[axis]), hn::Set(f, start)); };
    enter = hn::Max(hn::Max(at(near[0], 0, ray.near_start[0]), at(near[1], 1, ray.near_start[1])),
                    hn::Max(at(near[2], 2, ray.near_start[2]), hn::Set(f, ray.t_min)));
    const auto leave = hn::Min(hn::Min(at(far[0], 0, ray.far_start[0]), at(far[1], 1, ray.far_start[1])),
                               hn::Min(at(far[2], 2, ray.far_start[2]), hn::Set(f, limit)));
    return hn::Gt(enter, leave);
  }

  hn::Vec<F8> near[3], far[3];
};

/// A node's children from far to near for rays of an octant, three bits each, the farthest lowest: as rays of the
/// opposite octant meet them. (The byte before an order is the node's too.)
HWY_INLINE std::uint32_t far_to_near(const WideNode& node, std::uint32_t octant) {
  static_assert(std::endian::native == std::endian::little);
  std::uint32_t packed;
  std::memcpy(
      &packed,
      reinterpret_cast<const std::uint8_t*>(&node) + offsetof(WideNode, order) + std::size_t{3} * (octant ^ 7) - 1,
      sizeof packed);
  return packed >> 8;
}

/// Writes the children that a ray of an octant enters before `limit`, and where it enters them, farthest first; says
/// how many they are, and may write up to eight of each. They go there all at once, in the order that the node keeps
/// for the octant (Fuetterling et al. 2017): no sorting, and no branch that depends on how many there are.
HWY_INLINE int enter_children(const WideNode& node, std::uint32_t octant, const PlaneRows& rows, const TreeFrame& frame,
                              const SearchRay& ray, float limit, std::uint32_t* child, float* entry) {
  const F8 f;
  const U8 u;
  std::uint32_t order = far_to_near(node, octant);
  if constexpr (kLanes8 == 8) {
    hn::Vec<F8> enter;
    const auto missed = ChildPlanes(node, 0, rows, frame).missed_by(ray, limit, enter);
    const auto entered = hn::IfThenElse(hn::RebindMask(u, missed), hn::Set(u, kNoChild), hn::LoadU(u, node.child));
    alignas(32) static constexpr std::uint32_t kShifts[8] = {0, 3, 6, 9, 12, 15, 18, 21};
    const auto at = hn::And(hn::Shr(hn::Set(u, order), hn::Load(u, kShifts)), hn::Set(u, 7));
    const auto sorted = hn::TableLookupLanes(entered, hn::IndicesFromVec(u, at));
    const auto kept = hn::Ne(sorted, hn::Set(u, kNoChild));
    const auto sorted_enter = hn::TableLookupLanes(enter, hn::IndicesFromVec(f, at));
    hn::StoreU(compress(u, sorted, kept), u, child);
    hn::StoreU(compress(f, sorted_enter, hn::RebindMask(f, kept)), f, entry);
    return static_cast<int>(hn::CountTrue(u, kept));
  } else {
    std::uint32_t children[8];
    float entries[8];
    for (std::size_t first = 0; first < 8; first += kLanes8) {
      hn::Vec<F8> enter;
      const auto missed = ChildPlanes(node, first, rows, frame).missed_by(ray, limit, enter);
      hn::StoreU(hn::IfThenElse(hn::RebindMask(u, missed), hn::Set(u, kNoChild), hn::LoadU(u, node.child + first)), u,
                 children + first);
      hn::StoreU(enter, f, entries + first);
    }
    int count = 0;
    for (int i = 0; i < 8; ++i, order >>= 3) {
      child[count] = children[order & 7];
      entry[count] = entries[order & 7];
      count += child[count] != kNoChild;
    }
    return count;
  }
}

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

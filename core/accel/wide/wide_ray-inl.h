// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_WIDE_RAY_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_WIDE_RAY_INL
#undef TESSERA_WIDE_RAY_INL
#else
#define TESSERA_WIDE_RAY_INL
#endif

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

#include <hwy/highway.h>

#include "core/accel/index.h"
#include "core/accel/wide/compress-inl.h"
#include "core/accel/wide/mask-inl.h"
#include "core/accel/wide/wide_kernels.h"
#include "core/bounds/cull_pad.h"
#include "core/geometry/triangle.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Lanes for a node's children and a leaf's triangles: eight where the machine has them, otherwise a part at a time.
using F8 = hn::CappedTag<float, 8>;
using U8 = hn::Rebind<std::uint32_t, F8>;
inline constexpr std::size_t kLanes8 = hn::MaxLanes(F8());

/// Where a tree lies. Searches work with coordinates relative to its centre, so that rounding depends on how far a ray
/// starts from the tree, not on where the two stand in the world.
struct TreeFrame {
  explicit TreeFrame(const WideTree& tree) {
    const Vec3 middle = tree.root.center();
    for (int axis = 0; axis < 3; ++axis) {
      center[axis] = middle[axis];
      half[axis] = static_cast<float>(
          std::max(double{tree.root.hi[axis]} - middle[axis], double{middle[axis]} - tree.root.lo[axis]) *
          (1 + 4 * kUnitRoundoff));
    }
  }
  alignas(16) float center[4] = {};
  alignas(16) float half[4] = {};  ///< From there to the farther side, or a little more.
};

/// A row of a node's planes along an axis, relative to the centre.
HWY_INLINE hn::Vec<F8> planes(const WideNode& node, std::size_t row, int axis, const TreeFrame& frame) {
  const F8 f;
  const hn::Rebind<std::uint8_t, F8> bytes;
  const hn::Rebind<std::int32_t, F8> whole;
  const auto lattice = hn::LoadU(bytes, reinterpret_cast<const std::uint8_t*>(&node) + row);
  return hn::MulAdd(hn::ConvertTo(f, hn::PromoteTo(whole, lattice)), hn::Set(f, node.step[axis]),
                    hn::Set(f, node.origin[axis] - frame.center[axis]));
}

/// A ray set up to be clipped against a tree's nodes. This only culls (law L1 of the design) and is padded (law L2):
///
/// Let M be the greatest over the axes of the origin's distance from the centre plus half the tree's side, so that
/// every corner lies within M of the origin; u = 2^-24; i = 1/d. A plane relative to the centre is off by u·M for its
/// node's origin, 2u·M for the product where it isn't fused, and 1.1u·M for the sum. Its t is plane·i + start, start =
/// fl(fl(−origin·i) ∓ pad): the origin is off by u·M, i by u·i (on 2M at most), the products by u·M·i each, the two
/// sums by u·M·i and 2u·M·i. Together less than 13u·M·i; with what `cull_pad` covers beside its test of the bound (its
/// items 1 and 2) less than 15u·M·i, of the 16u·M·i that the pad is.
///
/// Where some of these may overflow (|i| is large for rays of hardly any length, which is legal), infinities would have
/// the wrong sign, and the axis is left out.
struct alignas(64) ClipRay {
  ClipRay() = default;
  HWY_INLINE ClipRay(const TreeFrame& frame, const Ray& ray) : t_min(ray.t_min) {
    static_assert(offsetof(Ray, t_min) == offsetof(Ray, direction) + sizeof(Vec3));
    const hn::FixedTag<float, 4> f;  // the three axes; the fourth lane is any number of the ray's
    const auto axes = hn::FirstN(f, 3);
    const auto direction = hn::LoadU(f, &ray.direction.x), size = hn::IfThenElseZero(axes, hn::Abs(direction));
    const auto from = hn::Sub(hn::LoadU(f, &ray.origin.x), hn::Load(f, frame.center));
    const auto far_side = hn::IfThenElseZero(axes, hn::Add(hn::Abs(from), hn::Load(f, frame.half)));
    const auto reach = hn::MaxOfLanes(f, far_side);
    const auto off = hn::MulAdd(reach, hn::Set(f, 8 * static_cast<float>(kUnitRoundoff * (1 + 8 * kUnitRoundoff))),
                                hn::Set(f, 8 * static_cast<float>(kDenormalStep)));
    const auto least = hn::Mul(hn::MaxOfLanes(f, size), hn::Set(f, kLeastSlope));
    const auto over = hn::Div(hn::Set(f, 1.0F), hn::CopySign(hn::Max(size, least), direction));
    const auto in_range =
        hn::Le(hn::Mul(hn::Mul(hn::Set(f, 4.0F), reach), hn::Abs(over)), hn::Set(f, std::numeric_limits<float>::max()));
    const auto kept = hn::IfThenElseZero(in_range, over), start = hn::Neg(hn::Mul(from, kept));
    const auto pad = hn::IfThenElse(
        in_range, hn::MulAdd(hn::Add(off, off), hn::Abs(kept), hn::Set(f, static_cast<float>(kDenormalSlack))),
        hn::Set(f, kInfinity));
    hn::Store(kept, f, inverse);
    hn::Store(hn::Sub(start, pad), f, near_start);
    hn::Store(hn::Add(start, pad), f, far_start);
    stray = hn::GetLane(off);
  }

  alignas(16) float inverse[4], near_start[4], far_start[4];
  float t_min;
  float stray;  ///< 8u·M: as far as a point is off, in space.
};

/// The axes across a ray and along it, as `TriangleRay` has them.
struct RayAxes {
  static HWY_INLINE RayAxes of(Vec3 direction) {
    // Without branches, since rays of all directions come in any order.
    const Vec3 size = abs(direction);
    const std::uint32_t of_two = !(size.x > size.y), is_third = !(std::max(size.x, size.y) > size.z);
    const std::uint32_t z = (of_two & (is_third - 1)) | is_third << 1;
    return {0b001001U >> 2 * z & 3, 0b010010U >> 2 * z & 3, z};
  }
  std::uint32_t x, y, z;
};

/// Bit a is set where the direction runs downwards along axis a.
HWY_INLINE std::uint32_t octant_of(Vec3 direction) {
  return static_cast<std::uint32_t>(std::signbit(direction.x) | std::signbit(direction.y) << 1 |
                                    std::signbit(direction.z) << 2);
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
  HWY_INLINE hn::Mask<F8> missed_by(const ClipRay& ray, float limit, hn::Vec<F8>& enter) const {
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
                              const ClipRay& ray, float limit, std::uint32_t* child, float* entry) {
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

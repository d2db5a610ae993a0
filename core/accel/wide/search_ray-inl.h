// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_SEARCH_RAY_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SEARCH_RAY_INL
#undef TESSERA_SEARCH_RAY_INL
#else
#define TESSERA_SEARCH_RAY_INL
#endif

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <type_traits>

#include <hwy/highway.h>

#include "core/accel/wide/wide_tree.h"
#include "core/bounds/cull_pad.h"
#include "core/math/transform.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

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

/// Rays' parts side by side, as many rays from `first` on as `D` has lanes. The last of all stands in for those that
/// are missing. Precondition: there are rays.
template <typename D>
struct RayLanes {
  static constexpr std::size_t kLanes = hn::MaxLanes(D());

  HWY_INLINE RayLanes(std::span<const Ray> rays, std::size_t first) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Ray& ray = rays[std::min(first + lane, rays.size() - 1)];
      origin[0][lane] = ray.origin.x;
      origin[1][lane] = ray.origin.y;
      origin[2][lane] = ray.origin.z;
      direction[0][lane] = ray.direction.x;
      direction[1][lane] = ray.direction.y;
      direction[2][lane] = ray.direction.z;
      t_min[lane] = ray.t_min;
      t_max[lane] = ray.t_max;
      object[lane] = ray.leaves.object;
      primitive[lane] = ray.leaves.primitive;
    }
  }

  alignas(64) float origin[3][kLanes], direction[3][kLanes], t_min[kLanes], t_max[kLanes];
  alignas(64) std::uint32_t object[kLanes], primitive[kLanes];  ///< What the rays leave.
};

/// No triangle has it.
inline constexpr std::uint32_t kNoTriangle = 0xFFFFFFFF;

/// The triangles of an object that rays leave.
template <typename D>
HWY_INLINE auto left_in(const RayLanes<D>& lanes, std::uint32_t object) {
  const hn::Rebind<std::uint32_t, D> whole;
  return hn::IfThenElse(hn::Eq(hn::Load(whole, lanes.object), hn::Set(whole, object)), hn::Load(whole, lanes.primitive),
                        hn::Set(whole, kNoTriangle));
}

/// A ray set up for a search of a tree, in a cache line: to be clipped against its nodes, and to rule out triangles
/// (see `LeafTriangles`). This only culls (law L1 of the design) and is padded (law L2):
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
struct alignas(64) SearchRay {
  float inverse[3];
  float t_min;
  float near_start[3];
  float beside;  ///< By `side` of a triangle: the least that a weight may be.
  float far_start[3];
  float stray;         ///< By its `area`: how far off a depth may be,
  float stray_by_t;    ///< and by how much more for each t of the limit.
  float facing;        ///< By its `area`: what the weights' sum is to exceed.
  std::uint32_t left;  ///< The triangle that the ray leaves.
  std::uint32_t axis;  ///< Of the direction, the longest.
};
static_assert(sizeof(SearchRay) == 64 && std::is_trivially_copyable_v<SearchRay>);
static_assert(offsetof(SearchRay, near_start) == 16 && offsetof(SearchRay, far_start) == 32 &&
              offsetof(SearchRay, stray_by_t) == 48 && offsetof(SearchRay, axis) == 60);

/// Sets up rays from `first` on, as many as `D` has lanes, for an object with this tree: of ray i that there is,
/// `out[i]`, and for each lane an octant. Precondition: `first` is one of the rays, and all are traceable.
template <typename D>
HWY_INLINE void set_up(D f, const TreeFrame& frame, std::uint32_t object, std::span<const Ray> rays, std::size_t first,
                       SearchRay* out, std::uint32_t (&octants)[hn::MaxLanes(D())]) {
  const hn::Rebind<std::uint32_t, D> whole;
  using Vector = hn::Vec<D>;
  constexpr auto u = static_cast<float>(kUnitRoundoff);
  const RayLanes<D> lanes(rays, first);
  const auto set = [&](float x) HWY_ATTR { return hn::Set(f, x); };
  const auto of = [&](const auto& values) HWY_ATTR { return hn::Load(f, values); };

  const Vector d[3] = {of(lanes.direction[0]), of(lanes.direction[1]), of(lanes.direction[2])};
  const Vector size[3] = {hn::Abs(d[0]), hn::Abs(d[1]), hn::Abs(d[2])};
  Vector from[3];
  Vector reach = hn::Zero(f);
  for (int axis = 0; axis < 3; ++axis) {
    from[axis] = hn::Sub(of(lanes.origin[axis]), set(frame.center[axis]));
    reach = hn::Max(reach, hn::Add(hn::Abs(from[axis]), set(frame.half[axis])));
  }
  // Denormal numbers are added, never multiplied or fused, which some machines take a hundred cycles for.
  const Vector off = hn::Add(hn::Mul(reach, set(8 * u * (1 + 8 * u))), set(8 * static_cast<float>(kDenormalStep)));
  const Vector of_two = hn::Max(size[0], size[1]), most = hn::Max(of_two, size[2]);

  Vector inverse[3], near_start[3], far_start[3];
  const Vector least = hn::Mul(most, set(kLeastSlope));
  for (int axis = 0; axis < 3; ++axis) {
    const auto over = hn::Div(set(1.0F), hn::CopySign(hn::Max(size[axis], least), d[axis]));
    const auto in_range =
        hn::Le(hn::Mul(hn::Mul(set(4.0F), reach), hn::Abs(over)), set(std::numeric_limits<float>::max()));
    inverse[axis] = hn::IfThenElseZero(in_range, over);
    const auto start = hn::Neg(hn::Mul(from[axis], inverse[axis]));
    const auto slack =
        hn::Add(hn::Mul(hn::Add(off, off), hn::Abs(inverse[axis])), set(static_cast<float>(kDenormalSlack)));
    const auto pad = hn::IfThenElse(in_range, slack, set(kInfinity));
    near_start[axis] = hn::Sub(start, pad);
    far_start[axis] = hn::Add(start, pad);
  }

  const Vector t_min = of(lanes.t_min), stray_by_t = hn::Mul(set(64 * u), most);
  const Vector stray =
      hn::MulAdd(set(2.0F), hn::Mul(stray_by_t, hn::Abs(t_min)), hn::MulAdd(set(8.0F), off, set(0x1p-60F)));
  const Vector beside = hn::Neg(hn::MulAdd(hn::Mul(set(32.0F), off), most, set(0x1p-60F)));
  const auto in_range =
      hn::And(hn::And(hn::Gt(most, set(0x1p-40F)), hn::Lt(most, set(0x1p40F))), hn::Lt(off, set(0x1p20F)));
  const Vector facing = hn::IfThenElse(in_range, hn::Mul(set(1024 * u), most), set(kInfinity));
  const auto left = left_in(lanes, object);
  const auto one_or_none =
      hn::IfThenElse(hn::RebindMask(whole, hn::Gt(size[0], size[1])), hn::Zero(whole), hn::Set(whole, 1));
  const auto axis = hn::IfThenElse(hn::RebindMask(whole, hn::Gt(of_two, size[2])), one_or_none, hn::Set(whole, 2));

  const auto is_down = [&](int i) HWY_ATTR { return hn::ShiftRight<31>(hn::BitCast(whole, d[i])); };
  hn::StoreU(hn::Or(is_down(0), hn::Or(hn::ShiftLeft<1>(is_down(1)), hn::ShiftLeft<2>(is_down(2)))), whole, octants);

  alignas(64) float quads[4][4 * RayLanes<D>::kLanes];
  hn::StoreInterleaved4(inverse[0], inverse[1], inverse[2], t_min, f, quads[0]);
  hn::StoreInterleaved4(near_start[0], near_start[1], near_start[2], beside, f, quads[1]);
  hn::StoreInterleaved4(far_start[0], far_start[1], far_start[2], stray, f, quads[2]);
  hn::StoreInterleaved4(stray_by_t, facing, hn::BitCast(f, left), hn::BitCast(f, axis), f, quads[3]);
  for (std::size_t i = first; i < std::min(first + RayLanes<D>::kLanes, rays.size()); ++i)
    for (std::size_t quad = 0; quad < 4; ++quad)
      std::memcpy(reinterpret_cast<char*>(out + i) + 16 * quad, quads[quad] + 4 * (i - first), 16);
}

/// The same for one ray; its octant.
HWY_INLINE std::uint32_t set_up(const TreeFrame& frame, std::uint32_t object, const Ray& ray, SearchRay& out) {
  const hn::CappedTag<float, 4> f;
  std::uint32_t octants[hn::MaxLanes(f)];
  set_up(f, frame, object, {&ray, 1}, 0, &out, octants);
  return octants[0];
}

/// Pads a ray further, for a tree over boxes of objects of which some are placed: by what `cull_pad` adds for that, and
/// by 2u·M for the sums with it.
HWY_INLINE void pad_for(const TreeFrame& frame, Vec3 origin, Transform::Error placed, SearchRay& search) {
  double reach = 0;
  for (int axis = 0; axis < 3; ++axis)
    reach = std::max(reach, std::abs(double{origin[axis]} - frame.center[axis]) + frame.half[axis]);
  const double more =
      8 * kUnitRoundoff * (placed.condition * (max_component(abs(origin)) + reach) + placed.offset + reach / 4);
  for (int axis = 0; axis < 3; ++axis) {
    const auto pad = static_cast<float>(more * std::abs(search.inverse[axis]) * (1 + 4 * kUnitRoundoff));
    const float known = pad >= 0 ? pad : kInfinity;
    search.near_start[axis] -= known;
    search.far_start[axis] += known;
  }
}

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

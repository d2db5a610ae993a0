// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_PICTURE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_PICTURE_INL
#undef TESSERA_PICTURE_INL
#else
#define TESSERA_PICTURE_INL
#endif

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/accel/wide/wide_kernels.h"
#include "core/accel/wide/wide_ray-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {

/// Lanes for the rays of a block.
using F16 = hn::CappedTag<float, 16>;
inline constexpr std::size_t kLanes16 = hn::MaxLanes(F16());
inline constexpr std::size_t kBlockRays = 16;
inline constexpr std::size_t kBlocks = kFanRays / kBlockRays;

/// More than a number that is off by the roundings of a few operations, and less.
inline constexpr float kMore = 1 + 8 * static_cast<float>(kUnitRoundoff),
                       kLess = 1 - 8 * static_cast<float>(kUnitRoundoff);

/// Some of a fan's blocks: bits.
using Blocks = std::uint64_t;
static_assert(kBlocks == 64);

/// The least multiple of a block's rays that holds so many.
constexpr std::size_t whole_blocks(std::size_t rays) { return (rays + kBlockRays - 1) / kBlockRays * kBlockRays; }

/// Rays that pass through one point, the apex, as they are seen from it: each is a point (u, v) of a picture, and what
/// they may hit covers an area of it. So a whole tile goes through a tree at once: nodes and triangles are turned away
/// by the areas that they project to, and a triangle's edges settle which rays can reach it (Davidovič et al., "3D
/// Rasterization: A Bridge between Rasterization and Ray Casting", 2012). The one exact routine decides.
///
/// The picture lies across the axis along which the rays run farthest; depth is along it, away from the apex. With M
/// the distance from the apex within which everything lies, a float coordinate relative to the apex is off by 4.1u·M at
/// most (a plane's: see `SearchRay`), and the rays' lines pass the apex by 2u·M at most. Areas are grown for that by
/// `stray`, 16u·M, over the depth; what is left of it covers the roundings of rays' u and v, and of the quotients that
/// they are compared with, 3u·|u| ≤ 3u·M/depth for what lies in the picture. Depths are grown by `stray` themselves.
///
/// Comparisons with NaN are false here and rule out. There is none: M lies within 2^±60, so that depths, multiples of
/// half an ulp of `stray`, have finite reciprocals or are zero or less, where areas end nowhere.
struct Picture {
  static constexpr float kWidest = 4;

  RayAxes axes;   ///< The picture's, and depth's.
  float sign;     ///< Of the axis, away from the apex.
  float apex[3];  ///< In the order of x, y, z.
  float reach;    ///< M.
  float stray;
  float u_most, v_most;  ///< The most that |u| and |v| are.
  std::uint32_t octant;  ///< Of the way that the rays take from the apex, most of them.
};

/// The rays in their picture. Blocks had better be small areas.
///
/// How far a ray is looked for is kept as 1/depth, "nearness", since along a plane that is linear in u and v.
struct FanRays {
  static constexpr float kNearest = std::numeric_limits<float>::max();

  /// `triangles` are those that the rays leave, if they do. Precondition: `rays` make whole blocks, one at least.
  FanRays(const float* x, const float* y, const float* z, std::size_t rays, const std::uint32_t* triangles = nullptr)
      : direction{x, y, z}, left(triangles), count(rays) {
    std::fill(block_least + blocks(), block_least + kBlocks, kInfinity);
  }

  std::size_t blocks() const { return count / kBlockRays; }
  Blocks all() const { return ~Blocks{0} >> (kBlocks - blocks()); }

  const float* const direction[3];
  const std::uint32_t* const left;
  const std::size_t count;
  alignas(64) float along[kFanRays];  ///< Depth for each t: the direction's size along the picture's axis.
  alignas(64) float u[kFanRays], v[kFanRays];
  /// What has less nearness doesn't matter to a ray, what has more than `sure` is sure to be less than what it hits so
  /// far, and within its interval's end. `least` is ∞ for rays that aren't looked for: nothing has as much.
  alignas(64) float least[kFanRays], sure[kFanRays];
  /// What has more nearness may lie before some ray's beginning.
  float most = kNearest;
  alignas(64) float u_lo[kBlocks], u_hi[kBlocks], v_lo[kBlocks], v_hi[kBlocks];
  alignas(64) float block_least[kBlocks];  ///< The least `least` in a block.
  Blocks raised = all();                   ///< Those whose `block_least` is out of date.

  HWY_INLINE void update_blocks() {
    const F16 f;
    for (; raised != 0; raised &= raised - 1) {
      const auto block = static_cast<std::size_t>(std::countr_zero(raised));
      auto lowest = hn::Load(f, least + block * kBlockRays);
      for (std::size_t k = kLanes16; k < kBlockRays; k += kLanes16)
        lowest = hn::Min(lowest, hn::Load(f, least + block * kBlockRays + k));
      block_least[block] = hn::GetLane(hn::MinOfLanes(f, lowest));
    }
  }
};

/// The picture of rays that leave the apex (`away` is 1) or lead to it (−1); fills in `fan` but for what is known of
/// the rays' hits. Nothing where they point so far apart that one picture can't hold them, where a direction is zero or
/// not finite, or where the scale is so small or large that a float's range gets in the way.
inline std::optional<Picture> take_picture(const TreeFrame& frame, Vec3 apex, float away, FanRays& fan) {
  constexpr float kLeastReach = 0x1p-60F, kMostReach = 0x1p60F;
  Picture out;
  const std::size_t half = fan.count / 2;
  const Vec3 middle = Vec3{fan.direction[0][half], fan.direction[1][half], fan.direction[2][half]} * away;
  out.axes = RayAxes::of(middle);
  out.sign = std::copysign(1.0F, middle[static_cast<int>(out.axes.z)]);
  out.octant = octant_of(middle);
  out.apex[0] = apex[static_cast<int>(out.axes.x)];
  out.apex[1] = apex[static_cast<int>(out.axes.y)];
  out.apex[2] = apex[static_cast<int>(out.axes.z)];

  const F16 f;
  const float *const xs = fan.direction[out.axes.x], *const ys = fan.direction[out.axes.y],
                     *const zs = fan.direction[out.axes.z];
  const auto widest = hn::Set(f, Picture::kWidest), forward = hn::Set(f, out.sign * away);
  auto fits = hn::Eq(widest, widest);
  auto longest = hn::Zero(f), u_most = longest, v_most = longest;
  for (std::size_t block = 0; block < fan.blocks(); ++block) {
    auto u_lo = hn::Set(f, kInfinity), v_lo = u_lo, u_hi = hn::Set(f, -kInfinity), v_hi = u_hi;
    for (std::size_t k = 0; k < kBlockRays; k += kLanes16) {
      const std::size_t i = block * kBlockRays + k;
      const auto x = hn::LoadU(f, xs + i), y = hn::LoadU(f, ys + i), z = hn::LoadU(f, zs + i);
      const auto along = hn::Mul(z, forward), most = hn::Mul(widest, along);
      // Each on its own: of a number and NaN, x86 takes the second for the greater.
      const auto is_near = hn::And(hn::Le(hn::Abs(x), most), hn::Le(hn::Abs(y), most));
      fits = hn::And(fits, hn::And(is_near, hn::Gt(along, hn::Zero(f))));
      longest = hn::Max(longest, hn::Max(along, hn::Max(hn::Abs(x), hn::Abs(y))));
      hn::Store(along, f, fan.along + i);
      const auto u = hn::Div(x, z), v = hn::Div(y, z);
      hn::Store(u, f, fan.u + i);
      hn::Store(v, f, fan.v + i);
      u_most = hn::Max(u_most, hn::Abs(u));
      v_most = hn::Max(v_most, hn::Abs(v));
      u_lo = hn::Min(u_lo, u);
      u_hi = hn::Max(u_hi, u);
      v_lo = hn::Min(v_lo, v);
      v_hi = hn::Max(v_hi, v);
    }
    fan.u_lo[block] = hn::GetLane(hn::MinOfLanes(f, u_lo));
    fan.u_hi[block] = hn::GetLane(hn::MaxOfLanes(f, u_hi));
    fan.v_lo[block] = hn::GetLane(hn::MinOfLanes(f, v_lo));
    fan.v_hi[block] = hn::GetLane(hn::MaxOfLanes(f, v_hi));
  }

  float reach = away < 0 ? hn::GetLane(hn::MaxOfLanes(f, longest)) : 0;
  for (int axis = 0; axis < 3; ++axis)
    reach = std::max(reach, std::abs(apex[axis] - frame.center[axis]) + frame.half[axis]);
  // Where t is denormal, its rounding would be more than what areas and nearness are off by.
  const bool is_long = away > 0 && !(hn::GetLane(hn::MaxOfLanes(f, longest)) <= 0x1p100F * reach);
  if (!is_finite(apex) || !hn::AllTrue(f, fits) || is_long || !(reach >= kLeastReach && reach <= kMostReach))
    return std::nullopt;
  out.reach = reach;
  out.u_most = hn::GetLane(hn::MaxOfLanes(f, u_most));
  out.v_most = hn::GetLane(hn::MaxOfLanes(f, v_most));
  out.stray = 16 * static_cast<float>(kUnitRoundoff * (1 + 8 * kUnitRoundoff)) * reach;
  return out;
}

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

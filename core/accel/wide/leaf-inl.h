// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_LEAF_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_LEAF_INL
#undef TESSERA_LEAF_INL
#else
#define TESSERA_LEAF_INL
#endif

#include <algorithm>
#include <cstring>
#include <optional>

#include <hwy/cache_control.h>

#include "core/accel/wide/wide_ray-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {

/// A leaf's rows (see `WideTree`).
struct Leaf {
  Leaf() = default;
  HWY_INLINE Leaf(const WideTree& tree, std::uint32_t leaf) : count(WideChild::count(leaf)) {
    const std::uint32_t* words = tree.leaves.data() + std::size_t{4} * WideChild::at(leaf);
    side = std::bit_cast<float>(words[0]);
    rows = reinterpret_cast<const float*>(words + 1);
  }

  HWY_INLINE Vec3 corner(std::size_t i, std::size_t k) const {
    return {rows[3 * k * count + i], rows[(3 * k + 1) * count + i], rows[(3 * k + 2) * count + i]};
  }
  HWY_INLINE std::uint32_t triangle(std::size_t i) const { return std::bit_cast<std::uint32_t>(rows[9 * count + i]); }

  /// The numbers of the triangles from `first` on.
  HWY_INLINE hn::Vec<U8> triangles(std::size_t first) const {
    return hn::BitCast(U8(), hn::LoadU(F8(), rows + 9 * count + first));
  }

  std::size_t count;
  float side;  ///< The longest of its triangles' boxes.
  const float* rows;
};

/// Asks for cache lines, which needn't all be ours. Calls of functions that only prefetch g++ 12 takes to do nothing
/// and drops, unless they are inlined before it looks: a lambda here once left no prefetch in the program.
HWY_INLINE void prefetch_lines(const void* from, std::size_t count) {
  constexpr std::uintptr_t kLine = 64;
  const auto at = reinterpret_cast<std::uintptr_t>(from);
  for (std::size_t i = 0; i < count; ++i) hwy::Prefetch(reinterpret_cast<const char*>(at + i * kLine));
}

/// Asks for the memory of what will be visited soon: of a leaf, for what the largest takes, since most are large.
HWY_INLINE void prefetch(const WideTree& tree, std::uint32_t child) {
  static_assert(sizeof(WideNode) == 2 * 64 && 4 * leaf_words(WideChild::kMostInLeaf) + 48 <= 6 * 64);
  if (WideChild::is_leaf(child))
    prefetch_lines(tree.leaves.data() + std::size_t{4} * WideChild::at(child), 6);
  else
    prefetch_lines(&tree.nodes[child], 2);
}

/// No triangle has it.
inline constexpr std::uint32_t kNoTriangle = 0xFFFFFFFF;

/// The triangle of an object that a ray leaves.
HWY_INLINE std::uint32_t left_in(const Ray& ray, std::uint32_t object) {
  return ray.leaves.object == object ? ray.leaves.primitive : kNoTriangle;
}

/// A ray set up to rule out a leaf's triangles, eight at a time, in float. What is left goes to the one exact routine.
struct LeafRay {
  LeafRay() = default;
  LeafRay(const Ray& ray, const ClipRay& clip, std::uint32_t object)
      : axes(RayAxes::of(ray.direction)), stray(clip.stray), t_min(ray.t_min), left(left_in(ray, object)) {
    float from[3], way[3];  // `Vec3::operator[]` branches
    std::memcpy(from, &ray.origin, sizeof from);
    std::memcpy(way, &ray.direction, sizeof way);
    origin[0] = from[axes.x];
    origin[1] = from[axes.y];
    origin[2] = from[axes.z];
    if (std::abs(clip.inverse[axes.z]) > 0x1p-100F) [[likely]] {
      inverse = clip.inverse[axes.z];
      shear[0] = way[axes.x] * inverse;
      shear[1] = way[axes.y] * inverse;
    } else {
      inverse = 1 / way[axes.z];
      shear[0] = way[axes.x] / way[axes.z];  // 1/d may be infinite, where d is denormal
      shear[1] = way[axes.y] / way[axes.z];
    }
    pad = clip.stray * std::abs(inverse) + static_cast<float>(kDenormalSlack);
  }

  /// The triangles from `first` on, as many as there are lanes, that may be hit at t ≤ limit: bits.
  ///
  /// The triangle that the ray leaves is out if the ray does run away from it: where |sum| > 8E (see below) it makes
  /// more than 130u with it, many times the roundings of its direction.
  ///
  /// A corner, seen from the ray (space being sheared as `TriangleRay` does it), is v − o − s·z: u·M for the
  /// difference, u·M for that of z, 2u·M for s, u·M for the product where it isn't fused and 2u·M for the result, less
  /// than e = 8uM. If the ray hits the triangle, whose box's longest side is l, corners are seen within 2l of it. A
  /// weight, two products of two such, is then off by less than 8le + 2e² and its own roundings, 4u(2l + e)²; since l ≤
  /// 2M, all that is less than E = 16e(l + e). So the three aren't on both sides of ±E.
  ///
  /// The hit's t lies between those of the corners' depths, each off by 3uM·i, and its own rounding is uM·i. It is
  /// their mean by the weights: with each weight off by E that is off by less than 3E·(last − first)/|sum|, and where
  /// |sum| > 8E, so that the shares' sizes sum up to 1.5 at most, by 11uM·i for roundings; with the corners' own error
  /// less than two pads of 8uM·i. Where 1/|sum| overflows, the slack is infinite or NaN, and nothing is ruled out by
  /// it.
  HWY_INLINE std::uint32_t possible(const Leaf& leaf, std::size_t first, float limit) const {
    const F8 f;
    const float uncertain = 16 * stray * (leaf.side + stray) + static_cast<float>(kDenormalSlack);
    struct Corner {
      hn::Vec<F8> x, y, z;
    };
    const float* const row[3] = {leaf.rows + first + axes.x * leaf.count, leaf.rows + first + axes.y * leaf.count,
                                 leaf.rows + first + axes.z * leaf.count};
    const std::size_t to_next = 3 * leaf.count;
    const auto corner = [&](std::size_t k) HWY_ATTR {
      const auto depth = hn::Sub(hn::LoadU(f, row[2] + k * to_next), hn::Set(f, origin[2]));
      const auto across = [&](int i) HWY_ATTR {
        const auto v = hn::Sub(hn::LoadU(f, row[i] + k * to_next), hn::Set(f, origin[i]));
        return hn::NegMulAdd(hn::Set(f, shear[i]), depth, v);
      };
      return Corner{across(0), across(1), depth};
    };
    const Corner a = corner(0), b = corner(1), c = corner(2);
    const auto wa = hn::NegMulAdd(c.y, b.x, hn::Mul(c.x, b.y));
    const auto wb = hn::NegMulAdd(a.y, c.x, hn::Mul(a.x, c.y));
    const auto wc = hn::NegMulAdd(b.y, a.x, hn::Mul(b.x, a.y));
    const auto one_side = hn::Lt(hn::Min(wa, hn::Min(wb, wc)), hn::Set(f, -uncertain));
    const auto other_side = hn::Gt(hn::Max(wa, hn::Max(wb, wc)), hn::Set(f, uncertain));
    const auto in_t = [&](const hn::Vec<F8>& depth) HWY_ATTR { return hn::Mul(depth, hn::Set(f, inverse)); };
    const auto ta = in_t(a.z), tb = in_t(b.z), tc = in_t(c.z);
    const auto first_t = hn::Min(ta, hn::Min(tb, tc)), last_t = hn::Max(ta, hn::Max(tb, tc));
    const auto sum = hn::Add(wa, hn::Add(wb, wc)), over_sum = hn::Div(hn::Set(f, 1.0F), sum);
    // Shares first: products of weights and t would leave a float's range where the mesh is very large or small.
    const auto share = [&](const hn::Vec<F8>& w) HWY_ATTR { return hn::Mul(w, over_sum); };
    const auto t = hn::MulAdd(share(wa), ta, hn::MulAdd(share(wb), tb, hn::Mul(share(wc), tc)));
    const auto apart = hn::Mul(hn::Set(f, 8 * uncertain), hn::Sub(last_t, first_t));
    const auto faces = hn::Gt(hn::Abs(sum), hn::Set(f, 8 * uncertain));
    const auto own = hn::And(faces, hn::RebindMask(f, hn::Eq(leaf.triangles(first), hn::Set(U8(), left))));
    const auto slack =
        hn::IfThenElse(faces, hn::MulAdd(apart, hn::Abs(over_sum), hn::Set(f, 2 * pad)), hn::Set(f, kInfinity));
    const auto behind = hn::Or(hn::Lt(last_t, hn::Set(f, t_min - pad)), hn::Lt(hn::Add(t, slack), hn::Set(f, t_min)));
    const auto beyond = hn::Or(hn::Gt(first_t, hn::Set(f, limit + pad)), hn::Gt(hn::Sub(t, slack), hn::Set(f, limit)));
    const auto out = hn::Or(hn::Or(hn::And(one_side, other_side), own), hn::Or(behind, beyond));
    return ~bits_of(f, out) & ((1U << std::min(kLanes8, leaf.count - first)) - 1);
  }

  RayAxes axes;
  float origin[3];  ///< In the order of the axes.
  float shear[2];
  float inverse, pad, stray, t_min;
  std::uint32_t left;  ///< The triangle that the ray leaves.
};

/// Calls `hit(t, triangle)` for hits in the leaf at t ≤ limit; it returns the new limit, or `kStop`.
template <typename Counter, typename OnHit>
HWY_INLINE float test_leaf(const Leaf& leaf, const Ray& ray, const LeafRay& culling, float limit, Counter tally,
                           OnHit&& hit) {
  for (std::size_t first = 0; first < leaf.count; first += kLanes8)
    for (std::uint32_t left = culling.possible(leaf, first, limit); left != 0; left &= left - 1) {
      const std::size_t i = first + static_cast<std::size_t>(std::countr_zero(left));
      const std::optional<float> t =
          intersect_triangle(TriangleRay(ray), leaf.corner(i, 0), leaf.corner(i, 1), leaf.corner(i, 2));
      tally.object(t.has_value());
      if (!t) continue;
      limit = hit(*t, leaf.triangle(i));
      if (limit == kStop) return kStop;
    }
  return limit;
}

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

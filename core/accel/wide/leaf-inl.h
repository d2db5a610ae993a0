// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_LEAF_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_LEAF_INL
#undef TESSERA_LEAF_INL
#else
#define TESSERA_LEAF_INL
#endif

#include <algorithm>
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

  std::size_t count;
  float side;  ///< The longest of its triangles' boxes.
  const float* rows;
};

/// Asks for the memory of what will be visited soon.
HWY_INLINE void prefetch(const WideTree& tree, std::uint32_t child) {
  constexpr std::size_t kLine = 64;
  const auto lines = [](const void* from, std::size_t bytes) {
    for (std::size_t at = 0; at < bytes; at += kLine) hwy::Prefetch(static_cast<const char*>(from) + at);
  };
  if (WideChild::is_leaf(child))
    lines(tree.leaves.data() + std::size_t{4} * WideChild::at(child), 4 * leaf_words(WideChild::count(child)));
  else
    lines(&tree.nodes[child], sizeof(WideNode));
}

/// A ray set up to rule out a leaf's triangles, eight at a time, in float. What is left goes to the one exact routine.
struct LeafRay {
  LeafRay() = default;
  LeafRay(const Ray& ray, const ClipRay& clip) : axes(RayAxes::of(ray.direction)), stray(clip.stray), t_min(ray.t_min) {
    const int x = static_cast<int>(axes.x), y = static_cast<int>(axes.y), z = static_cast<int>(axes.z);
    origin[0] = ray.origin[x];
    origin[1] = ray.origin[y];
    origin[2] = ray.origin[z];
    inverse = 1 / ray.direction[z];
    shear[0] = ray.direction[x] / ray.direction[z];  // 1/d may be infinite, where d is denormal
    shear[1] = ray.direction[y] / ray.direction[z];
    pad = clip.stray * std::abs(inverse) + static_cast<float>(kDenormalSlack);
  }

  /// The triangles from `first` on, as many as there are lanes, that may be hit at t ≤ limit: bits.
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
    const float* rows = leaf.rows + first;
    const auto corner = [&](std::size_t k) HWY_ATTR {
      const auto depth = hn::Sub(hn::LoadU(f, rows + (3 * k + axes.z) * leaf.count), hn::Set(f, origin[2]));
      const auto across = [&](std::uint32_t axis, int i) HWY_ATTR {
        const auto v = hn::Sub(hn::LoadU(f, rows + (3 * k + axis) * leaf.count), hn::Set(f, origin[i]));
        return hn::NegMulAdd(hn::Set(f, shear[i]), depth, v);
      };
      return Corner{across(axes.x, 0), across(axes.y, 1), depth};
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
    const auto slack = hn::IfThenElse(hn::Gt(hn::Abs(sum), hn::Set(f, 8 * uncertain)),
                                      hn::MulAdd(apart, hn::Abs(over_sum), hn::Set(f, 2 * pad)), hn::Set(f, kInfinity));
    const auto behind = hn::Or(hn::Lt(last_t, hn::Set(f, t_min - pad)), hn::Lt(hn::Add(t, slack), hn::Set(f, t_min)));
    const auto beyond = hn::Or(hn::Gt(first_t, hn::Set(f, limit + pad)), hn::Gt(hn::Sub(t, slack), hn::Set(f, limit)));
    const auto out = hn::Or(hn::And(one_side, other_side), hn::Or(behind, beyond));
    return ~bits_of(f, out) & ((1U << std::min(kLanes8, leaf.count - first)) - 1);
  }

  RayAxes axes;
  float origin[3];  ///< In the order of the axes.
  float shear[2];
  float inverse, pad, stray, t_min;
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

// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_LEAF_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_LEAF_INL
#undef TESSERA_LEAF_INL
#else
#define TESSERA_LEAF_INL
#endif

#include <algorithm>
#include <optional>

#include "core/accel/wide/cache_lines.h"
#include "core/accel/wide/wide_ray-inl.h"
#include "core/geometry/triangle.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {

/// A leaf's rows (see `WideTree`).
struct Leaf {
  HWY_INLINE Leaf(const WideTree& tree, std::uint32_t leaf)
      : count(WideChild::count(leaf)),
        rows(reinterpret_cast<const float*>(tree.leaves.data() + std::size_t{4} * WideChild::at(leaf))) {}

  HWY_INLINE Vec3 corner(std::size_t i, std::size_t k) const {
    return {rows[3 * k * count + i], rows[(3 * k + 1) * count + i], rows[(3 * k + 2) * count + i]};
  }
  HWY_INLINE std::uint32_t triangle(std::size_t i) const { return std::bit_cast<std::uint32_t>(rows[9 * count + i]); }

  /// The numbers of the triangles from `first` on.
  HWY_INLINE hn::Vec<U8> triangles(std::size_t first) const {
    return hn::BitCast(U8(), hn::LoadU(F8(), rows + 9 * count + first));
  }

  std::size_t count;
  const float* rows;
};

/// Asks for the memory of what will be visited soon: of a leaf, for what the largest takes, since most are large.
HWY_INLINE void prefetch(const WideTree& tree, std::uint32_t child) {
  static_assert(sizeof(WideNode) == 2 * kCacheLine && 4 * leaf_words(WideChild::kMostInLeaf) + 48 <= 6 * kCacheLine);
  if (WideChild::is_leaf(child))
    prefetch_lines(tree.leaves.data() + std::size_t{4} * WideChild::at(child), 6);
  else
    prefetch_lines(&tree.nodes[child], 2);
}

/// Triangles of a leaf from `first` on, as many as there are lanes, set up to be ruled out in float (after Möller &
/// Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997). What is left goes to the one exact routine.
struct LeafTriangles {
  HWY_INLINE LeafTriangles(const Leaf& leaf, std::size_t first)
      : number(leaf.triangles(first)), valid((1U << std::min(kLanes8, leaf.count - first)) - 1) {
    const F8 f;
    // What stands behind the last triangle's may be its number: denormal as a float, which some machines are slow with.
    const auto is_there = mask_of(f, valid);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto row = [&](std::size_t corner) HWY_ATTR {
        return hn::IfThenElseZero(is_there, hn::LoadU(f, leaf.rows + (3 * corner + axis) * leaf.count + first));
      };
      a[axis] = row(0);
      from_b[axis] = hn::Sub(a[axis], row(1));
      to_c[axis] = hn::Sub(row(2), a[axis]);
    }
    cross(to_c, from_b, normal);
    const auto largest = [](const Vectors& v)
                             HWY_ATTR { return hn::Max(hn::Abs(v[0]), hn::Max(hn::Abs(v[1]), hn::Abs(v[2]))); };
    const auto ab = largest(from_b), ac = largest(to_c);
    side = hn::Add(hn::Max(ab, ac), hn::Set(f, 0x1p-40F));
    area = hn::MulAdd(ab, ac, hn::Set(f, 0x1p-80F));
  }

  /// Those that a ray, set up as `search`, may hit at t ≤ limit: bits.
  ///
  /// Let M be as for `SearchRay`, so that corners lie within M of the origin; u = 2^-24; d the largest coordinate of
  /// the direction D, l that of both edges at a, and A the product of each one's own. Seen from the origin a corner is
  /// C = a − o, off by uM. C × D is below 2Md and off by 6uMd, of which products that aren't fused are 2uMd; its
  /// product with an edge, a corner's weight, is off by 40uMdl. The normal is below 2A and off by 8uA; its product with
  /// D, the sum of the weights, below 6Ad and off by 40uAd; that with C, the depth, off by 46uAM. The third weight is
  /// what the two others leave of the sum; as l ≤ 2M and A ≤ l² it is off by 202uMdl at most. 256uMdl is allowed for.
  ///
  /// Where |sum| > 1024uAd its sign is certain. Then a triangle that is hit has no weight on the other side of zero;
  /// and the hit's t, where t·sum is the depth, lies in the interval, of which let e be an end. That t is rounded, and
  /// `crossing` leaves 2^-30·M/d beside that: together with what sum, depth and this very comparison are off by,
  /// less than 48uAM + 60uAd|e|. 64uA(M + d|e|) is allowed for, or more: a limit that isn't `kStop` is t_min at least,
  /// so that |limit| ≤ limit + 2|t_min|.
  ///
  /// A triangle that the ray leaves is then out, too: the ray makes more than 160u with it, which is more than
  /// its direction was rounded by (see `Transform::from_rows`), and does run away from it.
  ///
  /// With d from 2^-40 to 2^40 and M to 2^41 what underflows is less than what is added against it, and nothing but the
  /// depth's bounds overflows: a slack that does rules out nothing, and where e·sum alone does, no depth reaches that
  /// far, being below 2^127. Of other rays nothing is ruled out.
  HWY_INLINE std::uint32_t possible(const Ray& ray, const SearchRay& search, float limit) const {
    const F8 f;
    const auto set = [&](Vec3 v, Vectors& out) HWY_ATTR {
      out[0] = hn::Set(f, v.x);
      out[1] = hn::Set(f, v.y);
      out[2] = hn::Set(f, v.z);
    };
    Vectors origin, direction, corner, across;
    set(ray.origin, origin);
    set(ray.direction, direction);
    for (int i = 0; i < 3; ++i) corner[i] = hn::Sub(a[i], origin[i]);
    cross(corner, direction, across);
    const auto sum = dot(normal, direction), size = hn::Abs(sum);
    const auto sign = hn::And(sum, hn::Set(f, -0.0F));
    const auto b = hn::Xor(dot(across, to_c), sign);
    const auto c = hn::Xor(dot(across, from_b), sign);
    const auto depth = hn::Xor(dot(normal, corner), sign);
    const auto least = hn::Min(hn::Sub(hn::Sub(size, b), c), hn::Min(b, c));
    const auto slack = [&](float of) HWY_ATTR { return hn::Mul(area, hn::Set(f, of)); };
    const auto faces = hn::Gt(size, slack(search.facing));
    const auto misses = hn::Lt(least, hn::Mul(side, hn::Set(f, search.beside)));
    const auto behind = hn::Lt(depth, hn::MulSub(size, hn::Set(f, search.t_min), slack(search.stray)));
    const auto beyond =
        hn::Gt(depth, hn::MulAdd(size, hn::Set(f, limit), slack(search.stray + search.stray_by_t * limit)));
    const auto own = hn::RebindMask(f, hn::Eq(number, hn::Set(U8(), search.left)));
    const auto out = hn::And(faces, hn::Or(hn::Or(misses, own), hn::Or(behind, beyond)));
    return ~bits_of(f, out) & valid;
  }

  using Vectors = hn::Vec<F8>[3];
  static HWY_INLINE void cross(const Vectors& p, const Vectors& q, Vectors& out) {
    out[0] = hn::NegMulAdd(p[2], q[1], hn::Mul(p[1], q[2]));
    out[1] = hn::NegMulAdd(p[0], q[2], hn::Mul(p[2], q[0]));
    out[2] = hn::NegMulAdd(p[1], q[0], hn::Mul(p[0], q[1]));
  }
  static HWY_INLINE hn::Vec<F8> dot(const Vectors& p, const Vectors& q) {
    return hn::MulAdd(p[0], q[0], hn::MulAdd(p[1], q[1], hn::Mul(p[2], q[2])));
  }

  Vectors a, from_b, to_c, normal;  ///< Corner a, a − b, c − a, and (b − a) × (c − a).
  hn::Vec<F8> side;                 ///< The largest coordinate of both edges at a, and what keeps it from underflow.
  hn::Vec<F8> area;                 ///< The product of their largest coordinates, and what keeps it from underflow.
  hn::Vec<U8> number;
  std::uint32_t valid;  ///< Lanes that hold a triangle: bits.
};

/// Calls `hit(t, triangle)` for hits in the leaf at t ≤ limit; it returns the new limit, or `kStop`.
template <typename Counter, typename OnHit>
HWY_INLINE float test_leaf(const Leaf& leaf, const Ray& ray, const SearchRay& search, float limit, Counter tally,
                           OnHit&& hit) {
  for (std::size_t first = 0; first < leaf.count; first += kLanes8)
    for (std::uint32_t left = LeafTriangles(leaf, first).possible(ray, search, limit); left != 0; left &= left - 1) {
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

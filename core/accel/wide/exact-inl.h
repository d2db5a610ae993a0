// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_EXACT_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_EXACT_INL
#undef TESSERA_EXACT_INL
#else
#define TESSERA_EXACT_INL
#endif

#include <algorithm>
#include <bit>
#include <cstddef>
#include <optional>

#include "core/accel/wide/leaf-inl.h"
#include "core/geometry/triangle.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {

/// Lanes for pairs of a ray and a triangle that are tested in double.
using D8 = hn::CappedTag<double, 8>;
using D8Float = hn::Rebind<float, D8>;
inline constexpr std::size_t kExactLanes = hn::MaxLanes(D8());
inline constexpr std::uint32_t kAllExactLanes = (1U << kExactLanes) - 1;

/// What `intersect_triangle` finds, in each lane. These are its operations in its order, so that each lane holds what
/// it returns, to the bit (law L1 of the design); where it turns to whole numbers a lane says so, and is to be asked
/// alone.
struct ExactHits {
  std::uint32_t hit;  ///< The line meets the triangle: bits. Whether within the ray's interval remains to be seen.
  std::uint32_t uncertain;  ///< Where this is set, neither `hit` nor `t` mean anything.
  hn::Vec<D8Float> t;
};

/// Corners as `TriangleRay::see` gives them.
struct SeenCorner {
  hn::Vec<D8> x, y, z;
};

/// A lane is uncertain within the limits of `crossing` and `depth_limit`.
HWY_INLINE ExactHits exact_hits(const SeenCorner& a, const SeenCorner& b, const SeenCorner& c,
                                const hn::Vec<D8>& scale_z) {
  const D8 d;
  const auto widest = [](const auto& p, const auto& q, const auto& r)
                          HWY_ATTR { return hn::Max(hn::Abs(p), hn::Max(hn::Abs(q), hn::Abs(r))); };
  const auto across = hn::Max(widest(a.x, b.x, c.x), widest(a.y, b.y, c.y));
  const auto deep = widest(a.z, b.z, c.z);
  const auto range = hn::Sub(hn::Max(a.z, hn::Max(b.z, c.z)), hn::Min(a.z, hn::Min(b.z, c.z)));
  const auto sign_limit = hn::Mul(hn::Mul(hn::Set(d, 0x1p-47), across), hn::Add(across, deep));
  const auto sum_limit = hn::Mul(hn::Mul(hn::Set(d, 0x1p-13), across), range);
  const auto wa = hn::Sub(hn::Mul(c.x, b.y), hn::Mul(c.y, b.x));
  const auto wb = hn::Sub(hn::Mul(a.x, c.y), hn::Mul(a.y, c.x));
  const auto wc = hn::Sub(hn::Mul(b.x, a.y), hn::Mul(b.y, a.x));
  const auto least = hn::Min(hn::Abs(wa), hn::Min(hn::Abs(wb), hn::Abs(wc)));
  const auto zero = hn::Zero(d);
  const auto inside = hn::Or(hn::Ge(hn::Min(wa, hn::Min(wb, wc)), zero), hn::Le(hn::Max(wa, hn::Max(wb, wc)), zero));
  const auto sum = hn::Add(hn::Add(wa, wb), wc);
  const auto depth = hn::Add(hn::Add(hn::Mul(wa, a.z), hn::Mul(wb, b.z)), hn::Mul(wc, c.z));
  const auto depth_limit = hn::Mul(hn::Mul(hn::Set(d, 4), sign_limit), deep);
  const auto is_safe = hn::And(hn::Gt(hn::Abs(sum), sum_limit), hn::Gt(hn::Abs(depth), depth_limit));
  const auto uncertain = hn::Or(hn::Not(hn::Gt(least, sign_limit)), hn::And(inside, hn::Not(is_safe)));
  return {bits_of(d, inside), bits_of(d, uncertain), hn::DemoteTo(D8Float(), hn::Div(depth, hn::Mul(sum, scale_z)))};
}

using D8Whole = hn::Rebind<std::int32_t, D8Float>;

/// Words as doubles, by their places.
HWY_INLINE hn::Vec<D8> word(const float* words, const hn::Vec<D8Whole>& at) {
  return hn::PromoteTo(D8(), hn::GatherIndex(D8Float(), words, at));
}

/// Pairs of a ray and a triangle that culling has left, tested exactly eight at a time.
class ExactQueue {
 public:
  ExactQueue(const WideTree& tree, std::span<const Ray> rays)
      : rays_(rays),
        ray_words_(&rays.data()->origin.x),
        words_(reinterpret_cast<const float*>(tree.leaves.data())),
        leaves_(tree.leaves.data()) {
    static_assert(offsetof(Ray, direction) == 3 * sizeof(float) && sizeof(Ray) % sizeof(float) == 0);
  }

  static constexpr std::size_t kPairs = 8;

  std::size_t size() const { return count_; }
  bool full() const { return count_ == kPairs; }

  /// Ray `ray` against triangle i of a leaf. Precondition: not full.
  HWY_INLINE void add(std::size_t ray, std::uint32_t axis, const Leaf& leaf, std::size_t i) {
    add_at(ray, axis, static_cast<std::int32_t>(static_cast<std::size_t>(leaf.rows - words_) + i),
           static_cast<std::int32_t>(leaf.count));
  }

  /// The same, for a triangle whose corner a.x stands at word `corner` of the leaves, the next coordinate `row` on.
  HWY_INLINE void add_at(std::size_t ray, std::uint32_t axis, std::int32_t corner, std::int32_t row) {
    ray_[count_] = static_cast<std::int32_t>(ray);
    axis_[count_] = static_cast<std::int32_t>(axis);
    corner_[count_] = corner;
    row_[count_] = row;
    ++count_;
  }

  /// Tests the pairs, and calls `tested(ray, is_hit, t, triangle)` for each: whether it hits within the ray's interval,
  /// and where; t means nothing otherwise. No branch in here depends on which do, since that can't be guessed.
  template <typename Counter, typename OnTest>
  HWY_INLINE void empty(Counter tally, OnTest&& tested) {
    const D8Float f;
    const D8Whole whole;
    for (std::size_t first = 0; first < count_; first += kExactLanes) {
      const auto of = [&](const std::int32_t* values) HWY_ATTR { return hn::LoadU(whole, values + first); };
      const auto z = of(axis_), row = of(row_), one = hn::Set(whole, 1), three = hn::Set(whole, 3);
      const auto next = [&](const auto& axis) HWY_ATTR {
        const auto after = hn::Add(axis, one);
        return hn::IfThenZeroElse(hn::Eq(after, three), after);
      };
      const auto x = next(z), y = next(x);
      const auto ray = hn::Mul(of(ray_), hn::Set(whole, sizeof(Ray) / sizeof(float)));
      const auto origin = [&](const auto& axis) HWY_ATTR { return word(ray_words_, hn::Add(ray, axis)); };
      const auto direction = [&](const auto& axis)
                                 HWY_ATTR { return word(ray_words_, hn::Add(hn::Add(ray, axis), three)); };
      const auto along = direction(z), shear_x = hn::Div(direction(x), along), shear_y = hn::Div(direction(y), along);
      const auto origin_x = origin(x), origin_y = origin(y), origin_z = origin(z);
      auto corner = of(corner_);
      const auto row_x = hn::Mul(x, row), row_y = hn::Mul(y, row), row_z = hn::Mul(z, row), rows = hn::Mul(three, row);
      const auto see = [&]() HWY_ATTR {
        const auto depth = hn::Sub(word(words_, hn::Add(corner, row_z)), origin_z);
        const SeenCorner out{hn::Sub(hn::Sub(word(words_, hn::Add(corner, row_x)), origin_x), hn::Mul(shear_x, depth)),
                             hn::Sub(hn::Sub(word(words_, hn::Add(corner, row_y)), origin_y), hn::Mul(shear_y, depth)),
                             depth};
        corner = hn::Add(corner, rows);
        return out;
      };
      const SeenCorner a = see(), b = see(), c = see();
      ExactHits found = exact_hits(a, b, c, along);
      alignas(32) float t[kPairs];
      hn::StoreU(found.t, f, t);
      const std::size_t here = std::min(kExactLanes, count_ - first);
      for (std::uint32_t left = found.uncertain & ((1U << here) - 1); left != 0; left &= left - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(left));
        const std::optional<float> at = alone(first + lane);
        t[lane] = at.value_or(kInfinity);
        found.hit |= 1U << lane;
      }
      for (std::size_t lane = 0; lane < here; ++lane) {
        const std::size_t pair = first + lane, number = static_cast<std::size_t>(ray_[pair]);
        const bool is_hit = (found.hit >> lane & 1) & (t[lane] > rays_[number].t_min) & (t[lane] < rays_[number].t_max);
        tally.object(is_hit);
        tested(number, is_hit, t[lane], leaves_[corner_[pair] + 9 * row_[pair]]);
      }
    }
    count_ = 0;
  }

 private:
  HWY_NOINLINE std::optional<float> alone(std::size_t pair) const {
    const auto corner = [&](int k) {
      const float* at = words_ + corner_[pair] + 3 * k * row_[pair];
      return Vec3{at[0], at[row_[pair]], at[2 * row_[pair]]};
    };
    const TriangleRay ray(rays_[static_cast<std::size_t>(ray_[pair])]);
    return intersect_triangle(ray, corner(0), corner(1), corner(2));
  }

  const std::span<const Ray> rays_;
  const float* ray_words_;
  const float* words_;  ///< Of the tree's leaves.
  const std::uint32_t* leaves_;
  std::size_t count_ = 0;
  /// For each pair: the ray's number and longest axis, where corner a.x of the triangle stands, and how far it is to
  /// the next coordinate.
  std::int32_t ray_[kPairs] = {}, axis_[kPairs] = {}, corner_[kPairs] = {}, row_[kPairs] = {};
};

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

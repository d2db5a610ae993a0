// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_EXACT_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_EXACT_INL
#undef TESSERA_EXACT_INL
#else
#define TESSERA_EXACT_INL
#endif

#include <algorithm>
#include <bit>
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

/// A lane is uncertain where a weight is up to `sign_limit`, or the weights of a hit sum up to `sum_limit`: which have
/// to be those of `crossing`, or greater, since a lane that is asked alone comes to the same in any case.
HWY_INLINE ExactHits exact_hits(const SeenCorner& a, const SeenCorner& b, const SeenCorner& c,
                                const hn::Vec<D8>& scale_z, const hn::Vec<D8>& sign_limit,
                                const hn::Vec<D8>& sum_limit) {
  const D8 d;
  const auto wa = hn::Sub(hn::Mul(c.x, b.y), hn::Mul(c.y, b.x));
  const auto wb = hn::Sub(hn::Mul(a.x, c.y), hn::Mul(a.y, c.x));
  const auto wc = hn::Sub(hn::Mul(b.x, a.y), hn::Mul(b.y, a.x));
  const auto least = hn::Min(hn::Abs(wa), hn::Min(hn::Abs(wb), hn::Abs(wc)));
  const auto zero = hn::Zero(d);
  const auto inside = hn::Or(hn::Ge(hn::Min(wa, hn::Min(wb, wc)), zero), hn::Le(hn::Max(wa, hn::Max(wb, wc)), zero));
  const auto sum = hn::Add(hn::Add(wa, wb), wc);
  const auto uncertain =
      hn::Or(hn::Not(hn::Gt(least, sign_limit)), hn::And(inside, hn::Not(hn::Gt(hn::Abs(sum), sum_limit))));
  const auto depth = hn::Add(hn::Add(hn::Mul(wa, a.z), hn::Mul(wb, b.z)), hn::Mul(wc, c.z));
  return {bits_of(d, inside), bits_of(d, uncertain), hn::DemoteTo(D8Float(), hn::Div(depth, hn::Mul(sum, scale_z)))};
}

/// The same with the limits of `crossing` themselves.
HWY_INLINE ExactHits exact_hits(const SeenCorner& a, const SeenCorner& b, const SeenCorner& c,
                                const hn::Vec<D8>& scale_z) {
  const D8 d;
  const auto widest = [](const auto& p, const auto& q, const auto& r)
                          HWY_ATTR { return hn::Max(hn::Abs(p), hn::Max(hn::Abs(q), hn::Abs(r))); };
  const auto across = hn::Max(widest(a.x, b.x, c.x), widest(a.y, b.y, c.y));
  const auto deep = widest(a.z, b.z, c.z);
  const auto range = hn::Sub(hn::Max(a.z, hn::Max(b.z, c.z)), hn::Min(a.z, hn::Min(b.z, c.z)));
  return exact_hits(a, b, c, scale_z, hn::Mul(hn::Mul(hn::Set(d, 0x1p-47), across), hn::Add(across, deep)),
                    hn::Mul(hn::Mul(hn::Set(d, 0x1p-13), across), range));
}

/// Pairs of a ray and a triangle that culling has left, tested exactly eight at a time.
class ExactQueue {
 public:
  static constexpr std::size_t kPairs = 8;

  bool full() const { return count_ == kPairs; }

  /// Precondition: not full. Ray and leaf stay where they are until the queue is emptied.
  HWY_INLINE void add(std::uint32_t number, const Ray& ray, RayAxes axes, const Leaf& leaf, std::size_t i) {
    const std::uint32_t order[3] = {axes.x, axes.y, axes.z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t k = 0; k < 3; ++k) corner_[k][axis][count_] = leaf.rows[(3 * k + order[axis]) * leaf.count + i];
      origin_[axis][count_] = ray.origin[static_cast<int>(order[axis])];
      direction_[axis][count_] = ray.direction[static_cast<int>(order[axis])];
    }
    number_[count_] = number;
    triangle_[count_] = leaf.triangle(i);
    ray_[count_] = &ray;
    leaf_[count_] = leaf;
    in_leaf_[count_] = i;
    ++count_;
  }

  /// Tests the pairs; calls `hit(number, t, triangle)` for those that hit within their ray's interval.
  template <typename Counter, typename OnHit>
  HWY_INLINE void empty(Counter tally, OnHit&& hit) {
    const D8 d;
    for (std::size_t first = 0; first < count_; first += kExactLanes) {
      const auto load = [&](const float* values)
                            HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(D8Float(), values + first)); };
      const auto along = load(direction_[2]);
      const auto shear_x = hn::Div(load(direction_[0]), along), shear_y = hn::Div(load(direction_[1]), along);
      const auto see = [&](std::size_t k) HWY_ATTR {
        const auto z = hn::Sub(load(corner_[k][2]), load(origin_[2]));
        return SeenCorner{hn::Sub(hn::Sub(load(corner_[k][0]), load(origin_[0])), hn::Mul(shear_x, z)),
                          hn::Sub(hn::Sub(load(corner_[k][1]), load(origin_[1])), hn::Mul(shear_y, z)), z};
      };
      const ExactHits found = exact_hits(see(0), see(1), see(2), along);
      alignas(32) float t[kPairs];
      hn::StoreU(found.t, D8Float(), t);
      const std::size_t here = std::min(kExactLanes, count_ - first);
      std::uint32_t left = (found.hit | found.uncertain) & ((1U << here) - 1);
      for (std::size_t i = here - static_cast<std::size_t>(std::popcount(left)); i > 0; --i) tally.object(false);
      for (; left != 0; left &= left - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(left)), pair = first + lane;
        std::optional<float> at = t[lane];
        if (found.uncertain >> lane & 1) [[unlikely]]
          at = alone(pair);
        else if (!(t[lane] > ray_[pair]->t_min && t[lane] < ray_[pair]->t_max))
          at = std::nullopt;
        tally.object(at.has_value());
        if (at) hit(number_[pair], *at, triangle_[pair]);
      }
    }
    count_ = 0;
  }

 private:
  std::optional<float> alone(std::size_t pair) const {
    const std::size_t i = in_leaf_[pair];
    return intersect_triangle(TriangleRay(*ray_[pair]), leaf_[pair].corner(i, 0), leaf_[pair].corner(i, 1),
                              leaf_[pair].corner(i, 2));
  }

  std::size_t count_ = 0;
  float corner_[3][3][kPairs] = {}, origin_[3][kPairs] = {};
  float direction_[3][kPairs] = {};
  std::uint32_t number_[kPairs], triangle_[kPairs];
  const Ray* ray_[kPairs];
  Leaf leaf_[kPairs];
  std::size_t in_leaf_[kPairs];
};

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_FAN_RAYS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_FAN_RAYS_INL
#undef TESSERA_FAN_RAYS_INL
#else
#define TESSERA_FAN_RAYS_INL
#endif

#include <algorithm>
#include <limits>

#include "core/accel/wide/exact-inl.h"
#include "core/accel/wide/picture-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {

/// What the exact routine needs of a fan's rays, in lanes. Rays whose longest axis isn't the picture's are tested one
/// by one.
class ExactFan {
 protected:
  ExactFan(const Picture& picture, std::span<const Ray> rays, const FanRays& fan)
      : picture_(picture), rays_(rays), sign_limit_(0x1p-47 * 1.01 * 4 * 6 * picture.reach * picture.reach) {
    std::copy_n(fan.irregular, kBlocks, irregular_);
    const D8 d;
    for (std::size_t i = 0; i < kFanRays; i += kExactLanes) {
      const auto of = [&](const float* values) HWY_ATTR { return hn::PromoteTo(d, hn::Load(D8Float(), values + i)); };
      const auto along = of(fan.direction[2]);
      hn::Store(along, d, scale_z_ + i);
      hn::Store(hn::Div(of(fan.direction[0]), along), d, shear_x_ + i);
      hn::Store(hn::Div(of(fan.direction[1]), along), d, shear_y_ + i);
    }
  }

  /// Triangle i of a leaf, for the rays from number `first` on, which start at `origin` (in the picture's order).
  HWY_INLINE ExactHits test_lanes(const Leaf& leaf, std::size_t i, std::size_t first,
                                  const hn::Vec<D8> (&origin)[3]) const {
    const D8 d;
    const auto see = [&](std::size_t k) HWY_ATTR {
      const auto at = [&](std::uint32_t axis)
                          HWY_ATTR { return hn::Set(d, double{leaf.rows[(3 * k + axis) * leaf.count + i]}); };
      const auto z = hn::Sub(at(picture_.axes.z), origin[2]);
      return SeenCorner{hn::Sub(hn::Sub(at(picture_.axes.x), origin[0]), hn::Mul(hn::Load(d, shear_x_ + first), z)),
                        hn::Sub(hn::Sub(at(picture_.axes.y), origin[1]), hn::Mul(hn::Load(d, shear_y_ + first), z)), z};
    };
    // Where signs are certain, a lane that is inside is a hit, and its corners are seen within twice the longest side
    // (`LeafRay::possible`): which is all that its sum is compared with.
    const double side = leaf.side * 1.01;
    return exact_hits(see(0), see(1), see(2), hn::Load(d, scale_z_ + first), hn::Set(d, sign_limit_),
                      hn::Set(d, 0x1p-13 * 2 * side * side));
  }

  /// Calls `many(first, asked)` for runs of rays that are asked for, and `one(ray)` for those that can't go with
  /// others.
  template <typename Many, typename One>
  HWY_INLINE void deal(std::size_t block, std::uint32_t possible, Many&& many, One&& one) const {
    const std::uint32_t regular = possible & ~irregular_[block];
    for (std::size_t k = 0; k < kBlockRays; k += kExactLanes) {
      const std::uint32_t asked = regular >> k & kAllExactLanes;
      if (asked != 0) many(block * kBlockRays + k, asked);
    }
    for (std::uint32_t left = possible & irregular_[block]; left != 0; left &= left - 1)
      one(block * kBlockRays + static_cast<std::size_t>(std::countr_zero(left)));
  }

  HWY_INLINE void enqueue(std::size_t ray, const Leaf& leaf, std::size_t i) {
    const bool regular = !(irregular_[ray / kBlockRays] >> ray % kBlockRays & 1);
    queue_.add(static_cast<std::uint32_t>(ray), rays_[ray], regular ? picture_.axes : RayAxes::of(rays_[ray].direction),
               leaf, i);
  }

  template <typename Counter>
  HWY_INLINE static void count(Counter tally, std::uint32_t asked, std::uint32_t hit) {
    if constexpr (Counter::kCounts)
      for (; asked != 0; asked &= asked - 1) tally.object(hit >> std::countr_zero(asked) & 1);
  }

  const Picture& picture_;
  const std::span<const Ray> rays_;
  /// A weight that is more than this has a certain sign in `crossing` too: corners and origins are within 2M of each
  /// other, so corners of regular rays, whose |shear| ≤ 1, are seen within 4M.
  const double sign_limit_;
  ExactQueue queue_;
  alignas(64) double shear_x_[kFanRays], shear_y_[kFanRays], scale_z_[kFanRays];
  std::uint32_t irregular_[kBlocks];
};

/// Rays from one origin, looking for their closest hits.
class ClosestFan : public ExactFan {
 public:
  ClosestFan(const Picture& picture, std::span<const Ray> rays, std::uint32_t object, std::span<Hit> hits, FanRays& fan)
      : ExactFan(picture, rays, fan), object_(object), hits_(hits), fan_(fan) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      best_t_[i] = std::min(hits[i].t, rays[i].t_max);
      // At the interval's open end no triangle is hit; at another object's hit, if that comes later.
      const bool open = hits[i].t >= rays[i].t_max;
      best_triangle_[i] = open || hits[i].object < object ? 0 : hits[i].object == object ? hits[i].primitive : kAny;
    }
    std::fill(best_t_ + rays.size(), best_t_ + kFanRays, 0.0F);
    std::fill(best_triangle_ + rays.size(), best_triangle_ + kFanRays, 0);
    const F16 f;
    for (std::size_t i = 0; i < kFanRays; i += kLanes16) {
      const auto along = hn::Abs(hn::Load(f, fan.direction[2] + i));
      const auto per_t = hn::Mul(along, hn::Set(f, 1 + 8 * static_cast<float>(kUnitRoundoff)));
      const auto limit = hn::Mul(hn::Load(f, best_t_ + i), per_t);
      hn::Store(per_t, f, per_t_ + i);
      hn::Store(hn::Min(limit, hn::Set(f, std::numeric_limits<float>::max())), f, fan.limit + i);
    }
    std::fill(fan.limit + rays.size(), fan.limit + kFanRays, -kInfinity);
  }

  /// Tests triangle i of a leaf for the rays of a block that `possible` has bits for.
  template <typename Counter>
  HWY_INLINE void test(std::size_t block, std::uint32_t possible, const Leaf& leaf, std::size_t i, Counter tally) {
    deal(
        block, possible, [&](std::size_t first, std::uint32_t asked) HWY_ATTR { many(first, asked, leaf, i, tally); },
        [&](std::size_t ray) HWY_ATTR { test_one(ray, leaf, i, tally); });
  }

  template <typename Counter>
  HWY_INLINE void test_one(std::size_t ray, const Leaf& leaf, std::size_t i, Counter tally) {
    enqueue(ray, leaf, i);
    if (queue_.full()) flush(tally);
  }

  template <typename Counter>
  HWY_INLINE void flush(Counter tally) {
    queue_.empty(tally, [&](std::uint32_t ray, float t, std::uint32_t triangle) HWY_ATTR { lower(ray, t, triangle); });
  }

  void finish() const {
    for (std::size_t block = 0; block < kBlocks; ++block)
      for (std::uint32_t left = found_[block]; left != 0; left &= left - 1) {
        const std::size_t ray = block * kBlockRays + static_cast<std::size_t>(std::countr_zero(left));
        hits_[ray] = {best_t_[ray], object_, best_triangle_[ray]};
      }
  }

 private:
  static constexpr std::uint32_t kAny = 0xFFFFFFFF;

  template <typename Counter>
  HWY_INLINE void many(std::size_t first, std::uint32_t asked, const Leaf& leaf, std::size_t i, Counter tally) {
    const D8 d;
    const D8Float f;
    const hn::Rebind<std::uint32_t, D8Float> u;
    const hn::Vec<D8> origin[3] = {hn::Set(d, double{picture_.apex[0]}), hn::Set(d, double{picture_.apex[1]}),
                                   hn::Set(d, double{picture_.apex[2]})};
    const std::uint32_t triangle = leaf.triangle(i);
    const ExactHits found = test_lanes(leaf, i, first, origin);
    const auto best = hn::Load(f, best_t_ + first);
    const auto tied = hn::And(hn::Eq(found.t, best),
                              hn::RebindMask(f, hn::Gt(hn::Load(u, best_triangle_ + first), hn::Set(u, triangle))));
    const auto less = hn::And(hn::Or(hn::Lt(found.t, best), tied), hn::Gt(found.t, hn::Load(f, fan_.t_min + first)));
    const std::uint32_t hit = asked & ~found.uncertain & found.hit & bits_of(f, less);
    count(tally, asked & ~found.uncertain, hit);
    if (hit != 0) {
      const std::uint8_t bytes[8] = {static_cast<std::uint8_t>(hit)};
      const auto mask = hn::LoadMaskBits(f, bytes);
      hn::BlendedStore(found.t, mask, f, best_t_ + first);
      hn::BlendedStore(hn::Set(u, triangle), hn::RebindMask(u, mask), u, best_triangle_ + first);
      hn::BlendedStore(hn::Mul(found.t, hn::Load(f, per_t_ + first)), mask, f, fan_.limit + first);
      found_[first / kBlockRays] |= hit << first % kBlockRays;
      fan_.lowered |= 1U << (first / kBlockRays);
    }
    for (std::uint32_t left = asked & found.uncertain; left != 0; left &= left - 1)
      test_one(first + static_cast<std::size_t>(std::countr_zero(left)), leaf, i, tally);
  }

  HWY_INLINE void lower(std::size_t ray, float t, std::uint32_t triangle) {
    if (t > best_t_[ray] || (t == best_t_[ray] && triangle >= best_triangle_[ray])) return;
    best_t_[ray] = t;
    best_triangle_[ray] = triangle;
    fan_.limit[ray] = t * per_t_[ray];
    found_[ray / kBlockRays] |= 1U << ray % kBlockRays;
    fan_.lowered |= 1U << (ray / kBlockRays);
  }

  const std::uint32_t object_;
  const std::span<Hit> hits_;
  FanRays& fan_;
  alignas(64) float best_t_[kFanRays];
  alignas(64) std::uint32_t best_triangle_[kFanRays];
  alignas(64) float per_t_[kFanRays];  ///< Depth for each t, or a little more.
  std::uint32_t found_[kBlocks] = {};  ///< Rays that hit something less than what they came with: bits.
};

/// Rays that lead to one point, asking whether anything lies on their way.
class OccludedFan : public ExactFan {
 public:
  OccludedFan(const Picture& picture, std::span<const Ray> rays, std::span<std::uint8_t> hidden, FanRays& fan)
      : ExactFan(picture, rays, fan), hidden_(hidden), fan_(fan) {
    for (std::size_t i = 0; i < kFanRays; ++i) {
      const Ray& ray = rays[std::min(i, rays.size() - 1)];
      origin_[0][i] = ray.origin[static_cast<int>(picture.axes.x)];
      origin_[1][i] = ray.origin[static_cast<int>(picture.axes.y)];
      origin_[2][i] = ray.origin[static_cast<int>(picture.axes.z)];
      t_max_[i] = ray.t_max;
      const float depth = std::abs(fan.direction[2][i]) * (1 + 8 * static_cast<float>(kUnitRoundoff)) + picture.stray;
      fan.limit[i] = i < rays.size() && !hidden[i] ? depth : -kInfinity;
    }
  }

  template <typename Counter>
  HWY_INLINE void test(std::size_t block, std::uint32_t possible, const Leaf& leaf, std::size_t i, Counter tally) {
    deal(
        block, possible, [&](std::size_t first, std::uint32_t asked) HWY_ATTR { many(first, asked, leaf, i, tally); },
        [&](std::size_t ray) HWY_ATTR { test_one(ray, leaf, i, tally); });
  }

  template <typename Counter>
  HWY_INLINE void test_one(std::size_t ray, const Leaf& leaf, std::size_t i, Counter tally) {
    enqueue(ray, leaf, i);
    if (queue_.full()) flush(tally);
  }

  template <typename Counter>
  HWY_INLINE void flush(Counter tally) {
    queue_.empty(tally, [&](std::uint32_t ray, float, std::uint32_t) HWY_ATTR { hide(ray); });
  }

 private:
  template <typename Counter>
  HWY_INLINE void many(std::size_t first, std::uint32_t asked, const Leaf& leaf, std::size_t i, Counter tally) {
    const D8 d;
    const D8Float f;
    const hn::Vec<D8> origin[3] = {hn::PromoteTo(d, hn::Load(f, origin_[0] + first)),
                                   hn::PromoteTo(d, hn::Load(f, origin_[1] + first)),
                                   hn::PromoteTo(d, hn::Load(f, origin_[2] + first))};
    const ExactHits found = test_lanes(leaf, i, first, origin);
    const auto within =
        hn::And(hn::Gt(found.t, hn::Load(f, fan_.t_min + first)), hn::Lt(found.t, hn::Load(f, t_max_ + first)));
    std::uint32_t hit = asked & ~found.uncertain & found.hit & bits_of(f, within);
    count(tally, asked & ~found.uncertain, hit);
    for (; hit != 0; hit &= hit - 1) hide(first + static_cast<std::size_t>(std::countr_zero(hit)));
    for (std::uint32_t left = asked & found.uncertain; left != 0; left &= left - 1)
      test_one(first + static_cast<std::size_t>(std::countr_zero(left)), leaf, i, tally);
  }

  HWY_INLINE void hide(std::size_t ray) {
    hidden_[ray] = 1;
    fan_.limit[ray] = -kInfinity;
    fan_.lowered |= 1U << (ray / kBlockRays);
  }

  const std::span<std::uint8_t> hidden_;
  FanRays& fan_;
  alignas(64) float origin_[3][kFanRays];
  alignas(64) float t_max_[kFanRays];
};

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

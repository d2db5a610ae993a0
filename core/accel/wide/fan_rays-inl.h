// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_FAN_RAYS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_FAN_RAYS_INL
#undef TESSERA_FAN_RAYS_INL
#else
#define TESSERA_FAN_RAYS_INL
#endif

#include <algorithm>

#include "core/accel/tally.h"
#include "core/accel/wide/dense_rays-inl.h"
#include "core/accel/wide/exact-inl.h"
#include "core/accel/wide/taken_triangles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {

/// Rays from one origin, looking for their closest hits.
///
/// A triangle that surely is hit, and surely less than what was hit before, need not be tested at once: only the last
/// such of each ray is, at the end, to learn its t.
class ClosestFan {
 public:
  static constexpr bool kLeave = false;      ///< Rays may leave triangles.
  static constexpr bool kAsksBlocks = true;  ///< It pays to ask which blocks lie outside a large triangle,
  static constexpr bool kAsksRays = false;   ///< and at a node which have rays in an area: here blocks are compact.

  /// `hits` are as many as the fan's rays, those of rays that aren't looked for with t = 0.
  HWY_INLINE ClosestFan(const WideTree& tree, const Picture& picture, Vec3 origin, std::uint32_t object, Hit* hits,
                        FanRays& fan)
      : picture_(picture),
        words_(reinterpret_cast<const float*>(tree.leaves.data())),
        origin_(origin),
        object_(object),
        hits_(hits),
        fan_(fan),
        queue_(tree, queued_) {
    const F16 f;
    const U16 u;
    const auto one = hn::Set(f, 1.0F), nearest = hn::Set(f, FanRays::kNearest), endless = hn::Set(f, kInfinity);
    const auto own = hn::Set(u, object);
    constexpr float farthest = 1 / FanRays::kNearest;
    for (std::size_t i = 0; i < fan.count; i += kLanes16) {
      const KnownHits known(hits + i);
      hn::Store(known.t, f, best_t_ + i);
      hn::Store(hn::Zero(I16()), I16(), place_ + i);
      if (hn::AllTrue(f, hn::Eq(known.t, endless))) {  // what follows, of rays that have hit nothing: most
        hn::Store(hn::Zero(I16()), I16(), best_triangle_ + i);
        hn::Store(hn::Set(f, farthest * kLess), f, fan.least + i);
        hn::Store(hn::Set(f, farthest * kMore), f, fan.sure + i);
        continue;
      }
      // At infinity no triangle is hit; at another object's hit, if that comes later.
      const auto open = hn::Or(hn::RebindMask(u, hn::Eq(known.t, endless)), hn::Lt(known.object, own));
      const auto number = hn::IfThenElse(hn::Eq(known.object, own), known.primitive, hn::Set(u, kAny));
      hn::Store(hn::BitCast(I16(), hn::IfThenZeroElse(open, number)), I16(), best_triangle_ + i);
      const auto depth = hn::Min(hn::Mul(known.t, hn::Load(f, fan.along + i)), nearest);
      const auto near = hn::Min(hn::Div(one, depth), nearest);
      hn::Store(hn::IfThenElse(hn::Gt(known.t, hn::Zero(f)), hn::Mul(near, hn::Set(f, kLess)), endless), f,
                fan.least + i);
      hn::Store(hn::Mul(near, hn::Set(f, kMore)), f, fan.sure + i);
    }
  }

  bool can_take() const { return !triangles_.full(); }

  /// The least nearness that matters to rays that surely hit something at `low` or nearer.
  static HWY_INLINE hn::Vec<F16> least_after(const hn::Vec<F16>& low) { return low; }

  /// Where triangle i of a leaf is kept, and the others side by side with it. Precondition: `can_take`.
  HWY_INLINE std::int32_t place(const Leaf& leaf, std::size_t i) {
    if (leaf.rows != last_rows_) {
      last_rows_ = leaf.rows;
      last_place_ = triangles_.add(leaf, corner(leaf, 0));
    }
    return last_place_ + static_cast<std::int32_t>(i);
  }

  /// Rays from `first` on, of which those in `mask` surely hit the triangles at `places`, at a nearness between `low`
  /// and `high`, and nothing so near before.
  HWY_INLINE void take(std::size_t first, hn::Mask<F16> mask, const hn::Vec<F16>& low, const hn::Vec<F16>& high,
                       const hn::Vec<I16>& places) {
    const F16 f;
    const I16 whole;
    hn::BlendedStore(low, mask, f, fan_.least + first);
    hn::BlendedStore(high, mask, f, fan_.sure + first);
    hn::BlendedStore(places, hn::RebindMask(whole, mask), whole, place_ + first);
    taken_[first / kBlockRays] |= bits_of(f, mask) << first % kBlockRays;
    fan_.raised |= Blocks{1} << (first / kBlockRays);
  }

  /// Tests triangle i of a leaf, by the time of `flush`.
  template <typename Counter>
  HWY_INLINE void test(std::size_t ray, const Leaf& leaf, std::size_t i, Counter tally) {
    // A triangle may stand in several leaves.
    const bool is_taken = taken_[ray / kBlockRays] >> ray % kBlockRays & 1;
    if (is_taken && triangles_.number(place_[ray]) == leaf.triangle(i)) return;
    test_at(ray, corner(leaf, i), static_cast<std::int32_t>(leaf.count), tally);
  }

  template <typename Counter>
  HWY_INLINE void flush(Counter tally) {
    queue_.empty(tally, [&](std::size_t place, bool is_hit, float t, std::uint32_t triangle) HWY_ATTR {
      if (is_hit) lower(queued_number_[place], t, triangle);
    });
  }

  /// Precondition: flushed.
  HWY_INLINE void finish() {
    for (std::size_t first = 0; first < fan_.count; first += kExactLanes) {
      const std::uint32_t taken = taken_[first / kBlockRays] >> first % kBlockRays & kAllExactLanes;
      if (taken != 0) settle(first, taken);
    }
    flush(NoTally());
    for (std::size_t first = 0; first < fan_.count; first += kLanes16) {
      const std::uint32_t found = found_[first / kBlockRays] >> first % kBlockRays;
      if (found == 0) continue;
      KnownHits known(hits_ + first);
      const auto here = mask_of(F16(), found);
      const auto whole = hn::RebindMask(U16(), here);
      known.t = hn::IfThenElse(here, hn::Load(F16(), best_t_ + first), known.t);
      known.object = hn::IfThenElse(whole, hn::Set(U16(), object_), known.object);
      known.primitive =
          hn::IfThenElse(whole, hn::BitCast(U16(), hn::Load(I16(), best_triangle_ + first)), known.primitive);
      known.store(hits_ + first);
    }
  }

 private:
  static constexpr std::uint32_t kAny = std::numeric_limits<std::int32_t>::max();

  /// Hits as they stand in memory, part by part.
  struct KnownHits {
    HWY_INLINE explicit KnownHits(const Hit* hits) {
      static_assert(sizeof(Hit) == 3 * sizeof(float));
      hn::Vec<U16> bits;
      hn::LoadInterleaved3(U16(), reinterpret_cast<const std::uint32_t*>(hits), bits, object, primitive);
      t = hn::BitCast(F16(), bits);
    }
    HWY_INLINE void store(Hit* hits) const {
      hn::StoreInterleaved3(hn::BitCast(U16(), t), object, primitive, U16(), reinterpret_cast<std::uint32_t*>(hits));
    }

    hn::Vec<F16> t;
    hn::Vec<U16> object, primitive;
  };

  template <typename Counter>
  HWY_INLINE void test_at(std::size_t ray, std::int32_t corner, std::int32_t row, Counter tally) {
    const Vec3 direction{fan_.direction[0][ray], fan_.direction[1][ray], fan_.direction[2][ray]};
    const std::size_t place = queue_.size();
    queued_[place] = {origin_, direction};
    queued_number_[place] = ray;
    queue_.add_at(place, RayAxes::of(direction).z, corner, row);
    if (queue_.full()) flush(tally);
  }

  /// Where the triangle's first corner stands among the words of the tree's leaves.
  HWY_INLINE std::int32_t corner(const Leaf& leaf, std::size_t i) const {
    return static_cast<std::int32_t>(static_cast<std::size_t>(leaf.rows - words_) + i);
  }

  /// Tests rays from `first` on with what was taken for them.
  HWY_INLINE void settle(std::size_t first, std::uint32_t taken) {
    const D8 d;
    const D8Float f;
    const D8Whole whole;
    const auto dx = hn::LoadU(f, fan_.direction[picture_.axes.x] + first),
               dy = hn::LoadU(f, fan_.direction[picture_.axes.y] + first),
               dz = hn::LoadU(f, fan_.direction[picture_.axes.z] + first);
    const auto along = hn::PromoteTo(d, dz);
    const auto shear_x = hn::Div(hn::PromoteTo(d, dx), along), shear_y = hn::Div(hn::PromoteTo(d, dy), along);
    const auto x = triangles_.along(picture_.axes.x, place_ + first),
               y = triangles_.along(picture_.axes.y, place_ + first),
               z = triangles_.along(picture_.axes.z, place_ + first);
    const auto triangle = hn::BitCast(whole, picture_.axes.x == 0 ? x.word : picture_.axes.y == 0 ? y.word : z.word);
    const auto see = [&](const auto& corner_x, const auto& corner_y, const auto& corner_z) HWY_ATTR {
      const auto at = [&](const auto& corner, int i)
                          HWY_ATTR { return hn::Sub(hn::PromoteTo(d, corner), hn::Set(d, double{picture_.apex[i]})); };
      const auto depth = at(corner_z, 2);
      return SeenCorner{hn::Sub(at(corner_x, 0), hn::Mul(shear_x, depth)),
                        hn::Sub(at(corner_y, 1), hn::Mul(shear_y, depth)), depth};
    };
    const SeenCorner a = see(x.a, y.a, z.a), b = see(x.b, y.b, z.b), c = see(x.c, y.c, z.c);
    const ExactHits found = exact_hits(a, b, c, along);
    // Rays whose longest axis isn't the picture's are seen along another, and asked alone.
    const std::uint32_t regular = bits_of(f, hn::Gt(hn::Abs(dz), hn::Max(hn::Abs(dx), hn::Abs(dy))));
    const std::uint32_t alone = taken & (found.uncertain | ~regular);
    const auto best = hn::Load(f, best_t_ + first);
    const auto best_triangle = hn::Load(whole, best_triangle_ + first);
    const auto tied = hn::And(hn::Eq(found.t, best), hn::RebindMask(f, hn::Gt(best_triangle, triangle)));
    const std::uint32_t less = taken & ~alone & found.hit & bits_of(f, hn::Or(hn::Lt(found.t, best), tied));
    const auto mask = mask_of(f, less);
    hn::BlendedStore(found.t, mask, f, best_t_ + first);
    hn::BlendedStore(triangle, hn::RebindMask(whole, mask), whole, best_triangle_ + first);
    found_[first / kBlockRays] |= less << first % kBlockRays;
    for (std::uint32_t left = alone; left != 0; left &= left - 1) {
      const std::size_t ray = first + static_cast<std::size_t>(std::countr_zero(left));
      test_at(ray, triangles_.corner(place_[ray]), triangles_.row_length(place_[ray]), NoTally());
    }
  }

  HWY_INLINE void lower(std::size_t ray, float t, std::uint32_t number) {
    const auto triangle = static_cast<std::int32_t>(number);
    if (t > best_t_[ray] || (t == best_t_[ray] && triangle >= best_triangle_[ray])) return;
    best_t_[ray] = t;
    best_triangle_[ray] = triangle;
    const float near = std::min(1 / (t * fan_.along[ray]), FanRays::kNearest);
    fan_.least[ray] = std::max(fan_.least[ray], near * kLess);
    fan_.sure[ray] = std::max(fan_.sure[ray], near * kMore);
    found_[ray / kBlockRays] |= 1U << ray % kBlockRays;
    fan_.raised |= Blocks{1} << (ray / kBlockRays);
  }

  const Picture& picture_;
  const float* words_;  ///< Of the tree's leaves.
  const Vec3 origin_;
  const std::uint32_t object_;
  Hit* const hits_;
  FanRays& fan_;
  Ray queued_[ExactQueue::kPairs];
  std::size_t queued_number_[ExactQueue::kPairs];
  ExactQueue queue_;
  TakenTriangles triangles_;
  const float* last_rows_ = nullptr;  ///< Of the leaf of which some triangle was taken last.
  std::int32_t last_place_ = 0;
  alignas(64) float best_t_[kFanRays];  ///< Of those that were tested.
  alignas(64) std::int32_t best_triangle_[kFanRays];
  /// Of the triangle that was taken. Others' places can be read too.
  alignas(64) std::int32_t place_[kFanRays];
  std::uint32_t taken_[kBlocks] = {};  ///< Rays that surely hit something: bits.
  std::uint32_t found_[kBlocks] = {};  ///< Rays that hit something less than what they came with: bits.
};

/// Rays that lead to one point, part by part; the last stands in for those that a block lacks. Precondition: there are
/// some, `kFanRays` at most.
struct RaysToPoint {
  HWY_INLINE RaysToPoint(Vec3 apex, std::uint32_t object, std::span<const Ray> rays)
      : count(whole_blocks(rays.size())) {
    const F16 f;
    const D8 d;
    auto most = hn::Zero(d), sum = hn::Zero(d);
    auto there = hn::Eq(hn::Zero(f), hn::Zero(f));
    for (std::size_t first = 0; first < count; first += kLanes16) {
      const RayLanes<F16> lanes(rays, first);
      for (std::size_t half = 0; half < kLanes16; half += kExactLanes)
        for (int axis = 0; axis < 3; ++axis) {
          const auto of = [&](const float* values)
                              HWY_ATTR { return hn::PromoteTo(d, hn::Load(D8Float(), values + half)); };
          const auto leads_to = hn::Add(of(lanes.origin[axis]), of(lanes.direction[axis]));
          const auto from_it = hn::Abs(hn::Sub(leads_to, hn::Set(d, double{apex[axis]})));
          most = hn::Max(most, from_it);
          sum = hn::Add(sum, from_it);
        }
      const auto t_min = hn::Load(f, lanes.t_min), t_max = hn::Load(f, lanes.t_max);
      there = hn::And(
          there, hn::And(hn::Ge(t_min, hn::Zero(f)), hn::And(hn::Lt(t_min, t_max), hn::Le(t_max, hn::Set(f, 1.0F)))));
      for (int axis = 0; axis < 3; ++axis) hn::Store(hn::Load(f, lanes.direction[axis]), f, direction[axis] + first);
      hn::Store(t_min, f, begin + first);
      hn::Store(t_max, f, end + first);
      hn::Store(left_in(lanes, object), hn::Rebind<std::uint32_t, F16>(), left + first);
    }
    const bool is_finite = hn::GetLane(hn::SumOfLanes(d, sum)) < std::numeric_limits<double>::infinity();
    off = is_finite && hn::AllTrue(f, there) ? hn::GetLane(hn::MaxOfLanes(d, most)) : kInfinity;
  }

  std::size_t count;
  alignas(64) float direction[3][kFanRays], begin[kFanRays], end[kFanRays];  ///< The ends are t_min and t_max.
  alignas(64) std::uint32_t left[kFanRays];
  /// How far, along an axis, they lead past the point at most; infinite where one has no finite origin or direction, no
  /// interval, or may hit what lies behind its origin or beyond where it leads. Zero directions no picture can hold.
  double off;
};

/// Rays that lead to one point, asking whether anything lies on their way. What surely does need not be tested.
class OccludedFan {
 public:
  static constexpr bool kLeave = true;
  static constexpr bool kAsksBlocks = false;  // most rays are hidden by then: it cost 2%
  static constexpr bool kAsksRays = true;     // blocks may be long: without, the terrain took a fifth more

  static constexpr bool can_take() { return true; }

  static HWY_INLINE hn::Vec<F16> least_after(const hn::Vec<F16>&) { return hn::Set(F16(), kInfinity); }
  static std::int32_t place(const Leaf&, std::size_t) { return 0; }

  OccludedFan(const WideTree& tree, const Picture& picture, const RaysToPoint& ends, std::span<const Ray> rays,
              std::span<std::uint8_t> hidden, FanRays& fan)
      : rays_(rays), hidden_(hidden), fan_(fan), queue_(tree, rays) {
    // A ray ends where t_max says before the apex, and begins where it says before the other end.
    const F16 f;
    const auto one = hn::Set(f, 1.0F), more = hn::Set(f, kMore), less = hn::Set(f, kLess),
               endless = hn::Set(f, kInfinity);
    const auto stray = hn::Set(f, picture.stray);
    auto most = hn::Set(f, FanRays::kNearest);
    for (std::size_t first = 0; first < fan.count; first += kLanes16) {
      std::uint32_t sought = 0;
      for (std::size_t i = first; i < std::min(first + kLanes16, rays.size()); ++i)
        sought |= std::uint32_t{!hidden[i]} << (i - first);
      const auto along = hn::Load(f, fan.along + first);
      const auto least = hn::Div(less, hn::MulAdd(along, more, stray));
      hn::Store(hn::IfThenElse(mask_of(f, sought), least, endless), f, fan.least + first);
      const auto begins = hn::MulSub(hn::Mul(along, hn::Sub(one, hn::Load(f, ends.begin + first))), less, stray);
      const auto surely = hn::Gt(begins, hn::Zero(f));
      hn::Store(hn::IfThenElse(surely, hn::Div(more, begins), endless), f, fan.sure + first);
      const auto rest = hn::MulAdd(hn::Mul(along, hn::Sub(one, hn::Load(f, ends.end + first))), more, stray);
      most = hn::Min(most, hn::Div(less, rest));
    }
    fan.most = hn::GetLane(hn::MinOfLanes(f, most));
  }

  HWY_INLINE void take(std::size_t first, hn::Mask<F16> mask, const hn::Vec<F16>&, const hn::Vec<F16>&,
                       const hn::Vec<I16>&) {
    const F16 f;
    hn::BlendedStore(hn::Set(f, kInfinity), mask, f, fan_.least + first);
    for (std::uint32_t left = bits_of(f, mask); left != 0; left &= left - 1)
      hidden_[first + static_cast<std::size_t>(std::countr_zero(left))] = 1;
    fan_.raised |= Blocks{1} << (first / kBlockRays);
  }

  template <typename Counter>
  HWY_INLINE void test(std::size_t ray, const Leaf& leaf, std::size_t i, Counter tally) {
    queue_.add(ray, RayAxes::of(rays_[ray].direction).z, leaf, i);
    if (queue_.full()) flush(tally);
  }

  template <typename Counter>
  HWY_INLINE void flush(Counter tally) {
    queue_.empty(tally, [&](std::size_t ray, bool is_hit, float, std::uint32_t) HWY_ATTR {
      if (is_hit) hide(ray);
    });
  }

 private:
  HWY_INLINE void hide(std::size_t ray) {
    hidden_[ray] = 1;
    fan_.least[ray] = kInfinity;
    fan_.raised |= Blocks{1} << (ray / kBlockRays);
  }

  const std::span<const Ray> rays_;
  const std::span<std::uint8_t> hidden_;
  FanRays& fan_;
  ExactQueue queue_;
};

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

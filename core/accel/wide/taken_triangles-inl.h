// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_TAKEN_TRIANGLES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_TAKEN_TRIANGLES_INL
#undef TESSERA_TAKEN_TRIANGLES_INL
#else
#define TESSERA_TAKEN_TRIANGLES_INL
#endif

#include "core/accel/wide/exact-inl.h"
#include "core/accel/wide/wide_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {

/// Leaves with triangles that rays are to be tested with later. They are copied from their leaves so that those of
/// several rays come into registers by whole rows, which are then turned into columns: with their ten words gathered
/// one by one, whole fans took 18 to 20% longer on meshes of 70,000 and 100,000 triangles.
class TakenTriangles {
 public:
  bool full() const { return count_ + WideChild::kMostInLeaf > kMost; }

  /// Keeps a leaf's triangles side by side, of which the first's corner a.x stands at word `corner` of all leaves'; the
  /// first's place here. Precondition: not full. All of them, since a loop over those that are needed is sooner guessed
  /// wrong.
  HWY_INLINE std::int32_t add(const Leaf& leaf, std::int32_t corner) {
    const F8 f;
    const hn::Rebind<std::int32_t, F8> whole;
    for (std::size_t first = 0; first < leaf.count; first += kLanes8) {
      const hn::Vec<F8> words[3] = {hn::BitCast(f, leaf.triangles(first)),
                                    hn::BitCast(f, hn::Iota(whole, corner + static_cast<std::int32_t>(first))),
                                    hn::BitCast(f, hn::Set(whole, static_cast<std::int32_t>(leaf.count)))};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto of = [&](std::size_t k)
                            HWY_ATTR { return hn::LoadU(f, leaf.rows + first + (3 * k + axis) * leaf.count); };
        hn::StoreInterleaved4(of(0), of(1), of(2), words[axis], f,
                              reinterpret_cast<float*>(triangles_[axis] + count_ + first));
      }
    }
    const std::size_t place = count_;
    count_ += leaf.count;
    return static_cast<std::int32_t>(place);
  }

  std::uint32_t number(std::int32_t place) const { return row(place, 0).word; }
  std::int32_t corner(std::int32_t place) const { return static_cast<std::int32_t>(row(place, 1).word); }
  std::int32_t row_length(std::int32_t place) const { return static_cast<std::int32_t>(row(place, 2).word); }

  /// For each lane a triangle's corners along an axis, and a word.
  template <typename V>
  struct Columns {
    V a, b, c, word;
  };

  /// Of the triangles at `places`, one for each lane. The word along x is the triangle's number.
  template <std::size_t kLanes = kExactLanes, typename D = hn::CappedTag<float, kLanes>>
  HWY_INLINE Columns<hn::Vec<D>> along(std::uint32_t axis, const std::int32_t* places) const {
    const D d;
    const hn::FixedTag<float, 4> four;
    const auto lane = [&](std::size_t i) HWY_ATTR { return hn::Load(four, row(places[i], axis).corner); };
    if constexpr (kLanes == 8) {
      const auto lanes = [&](std::size_t i) HWY_ATTR { return hn::Combine(d, lane(i + 4), lane(i)); };
      return turned(d, lanes(0), lanes(1), lanes(2), lanes(3));
    } else if constexpr (kLanes == 4) {
      return turned(d, lane(0), lane(1), lane(2), lane(3));
    } else {
      const auto p = lane(0), q = lane(1);
      const auto both = turned(four, p, q, p, q);
      return {hn::LowerHalf(d, both.a), hn::LowerHalf(d, both.b), hn::LowerHalf(d, both.c),
              hn::LowerHalf(d, both.word)};
    }
  }

 private:
  /// What full leaves for every fourth ray hold: of more, rays are tested at once.
  static constexpr std::size_t kMost = 2 * kFanRays;

  struct alignas(16) Row {
    float corner[3];
    std::uint32_t word;
  };

  const Row& row(std::int32_t place, std::uint32_t axis) const {
    return triangles_[axis][static_cast<std::size_t>(place)];
  }

  /// Turns each block of four rows into columns.
  template <typename D, typename V = hn::Vec<D>>
  static HWY_INLINE Columns<V> turned(D d, const V& p, const V& q, const V& r, const V& s) {
    const hn::RepartitionToWide<D> pairs;
    const auto lower_pq = hn::BitCast(pairs, hn::InterleaveLower(d, p, q)),
               lower_rs = hn::BitCast(pairs, hn::InterleaveLower(d, r, s)),
               upper_pq = hn::BitCast(pairs, hn::InterleaveUpper(d, p, q)),
               upper_rs = hn::BitCast(pairs, hn::InterleaveUpper(d, r, s));
    return {hn::BitCast(d, hn::InterleaveLower(pairs, lower_pq, lower_rs)),
            hn::BitCast(d, hn::InterleaveUpper(pairs, lower_pq, lower_rs)),
            hn::BitCast(d, hn::InterleaveLower(pairs, upper_pq, upper_rs)),
            hn::BitCast(d, hn::InterleaveUpper(pairs, upper_pq, upper_rs))};
  }

  std::size_t count_ = 0;
  Row triangles_[3][kMost];
};

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

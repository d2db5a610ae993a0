// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_COMPRESS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_COMPRESS_INL
#undef TESSERA_COMPRESS_INL
#else
#define TESSERA_COMPRESS_INL
#endif

#include <array>
#include <cstdint>

#include "core/accel/wide/mask-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// For each mask of kLanes lanes, the numbers of those that are set, the lowest first.
template <std::size_t kLanes>
alignas(64) inline constexpr auto kSetLanes = [] {
  std::array<std::array<std::uint8_t, kLanes>, std::size_t{1} << kLanes> all{};
  for (std::size_t bits = 0; bits < all.size(); ++bits)
    for (std::size_t lane = 0, at = 0; lane < kLanes; ++lane)
      if (bits >> lane & 1) all[bits][at++] = static_cast<std::uint8_t>(lane);
  return all;
}();

static_assert(kSetLanes<4>[0b1010] == std::array<std::uint8_t, 4>{1, 3});

/// A vector's lanes in `mask`, side by side from the first lane on; what follows them means nothing. Lanes have 32
/// bits. Where the machine has no instruction for it, Highway 1.0 has a table within the function, which g++ 12 writes
/// to the stack at each call: streams of rays were half as fast for it with AVX2.
template <typename D>
HWY_INLINE hn::Vec<D> compress(D d, hn::Vec<D> lanes, hn::Mask<D> mask) {
  static_assert(sizeof(hn::TFromD<D>) == 4);
#if HWY_TARGET <= HWY_AVX3  // or better: lower is
  (void)d;
  return hn::Compress(lanes, mask);
#else
  const hn::RebindToUnsigned<D> u;
  static_assert(hn::MaxLanes(d) <= 8);
  const auto set = hn::LoadU(hn::Rebind<std::uint8_t, D>(), kSetLanes<hn::MaxLanes(d)>[bits_of(d, mask)].data());
  return hn::TableLookupLanes(lanes, hn::IndicesFromVec(d, hn::PromoteTo(u, set)));
#endif
}

/// For each mask of kLanes lanes, how many are set below each.
template <std::size_t kLanes>
alignas(64) inline constexpr auto kSetBelow = [] {
  std::array<std::array<std::uint8_t, kLanes>, std::size_t{1} << kLanes> all{};
  for (std::size_t bits = 0; bits < all.size(); ++bits)
    for (std::size_t lane = 0, below = 0; lane < kLanes; below += bits >> lane++ & 1)
      all[bits][lane] = static_cast<std::uint8_t>(below);
  return all;
}();

static_assert(kSetBelow<4>[0b1010] == std::array<std::uint8_t, 4>{0, 0, 1, 1});

/// The reverse of `compress`: the first lanes, one for each lane in `mask`; what the others hold means nothing.
template <typename D>
HWY_INLINE hn::Vec<D> expand(D d, hn::Vec<D> lanes, hn::Mask<D> mask) {
  static_assert(sizeof(hn::TFromD<D>) == 4);
#if HWY_TARGET <= HWY_AVX3
  const hn::RebindToUnsigned<D> u;
  const auto bits = hn::BitCast(u, lanes);
  if constexpr (hn::MaxLanes(d) == 16)
    return hn::BitCast(d, hn::Vec<decltype(u)>{_mm512_maskz_expand_epi32(hn::RebindMask(u, mask).raw, bits.raw)});
  else
    return hn::BitCast(d, hn::Vec<decltype(u)>{_mm256_maskz_expand_epi32(hn::RebindMask(u, mask).raw, bits.raw)});
#else
  const hn::RebindToUnsigned<D> u;
  static_assert(hn::MaxLanes(d) <= 8);
  const auto below = hn::LoadU(hn::Rebind<std::uint8_t, D>(), kSetBelow<hn::MaxLanes(d)>[bits_of(d, mask)].data());
  return hn::TableLookupLanes(lanes, hn::IndicesFromVec(d, hn::PromoteTo(u, below)));
#endif
}

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

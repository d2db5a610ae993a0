// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_MASK_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_MASK_INL
#undef TESSERA_MASK_INL
#else
#define TESSERA_MASK_INL
#endif

#include <bit>
#include <cstdint>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Masks cross to numbers and back as whole words: put together from bytes, g++ 12 does so at run time. Highway asks for
// room for eight bytes either way.
static_assert(std::endian::native == std::endian::little);

/// The lanes' bits, lowest lane first.
template <typename D>
HWY_INLINE std::uint32_t bits_of(D d, hn::Mask<D> mask) {
  static_assert(hn::MaxLanes(d) <= 32);
  std::uint64_t bits = 0;
  hn::StoreMaskBits(d, mask, reinterpret_cast<std::uint8_t*>(&bits));
  return static_cast<std::uint32_t>(bits);
}

/// The lanes whose bits are set; bits beyond the lanes mean nothing.
template <typename D>
HWY_INLINE hn::Mask<D> mask_of(D d, std::uint64_t bits) {
  return hn::LoadMaskBits(d, reinterpret_cast<const std::uint8_t*>(&bits));
}

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

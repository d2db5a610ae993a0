// Per-target: compiled once for each instruction set (wide_kernels.cpp).
#if defined(TESSERA_DENSE_RAYS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_DENSE_RAYS_INL
#undef TESSERA_DENSE_RAYS_INL
#else
#define TESSERA_DENSE_RAYS_INL
#endif

#include "core/accel/wide/compress-inl.h"
#include "core/accel/wide/picture-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::HWY_NAMESPACE {

using U16 = hn::Rebind<std::uint32_t, F16>;
using I16 = hn::Rebind<std::int32_t, F16>;

/// Some rays out of a fan's blocks, side by side. A leaf of small triangles sees a few rays of each of several blocks:
/// so they fill vectors, which then go through all of its triangles without a branch.
struct DenseRays {
  /// Rays up to which this pays; beyond, most blocks of a triangle are full: measured on meshes of 70,000 to 2 million
  /// triangles.
  static constexpr std::size_t kMost = 64;
  static constexpr std::size_t kRoom = kMost + kLanes16;  ///< For what is written behind the last.
  static constexpr std::int32_t kNone = -1;

  std::size_t count;
  float u[kRoom], v[kRoom], least[kRoom], sure[kRoom];  ///< As in `FanRays`.
  std::uint32_t left[kRoom];
  std::uint32_t ray[kRoom];   ///< In the fan.
  std::int32_t taken[kRoom];  ///< Which of the leaf's triangles, or `kNone`.

  /// Calls `visit(first, mask, at)` for each vector of the blocks' rays: those from `first` on in the fan, of which the
  /// ones in `mask` stand here from `at` on; says how many stand here. `in_block` has a bit for each ray of a block.
  template <typename Visit>
  static HWY_INLINE std::size_t each_vector(Blocks blocks, const std::uint32_t (&in_block)[kBlocks], Visit&& visit) {
    std::size_t at = 0;
    for (; blocks != 0; blocks &= blocks - 1) {
      const auto block = static_cast<std::size_t>(std::countr_zero(blocks));
      for (std::size_t k = 0; k < kBlockRays; k += kLanes16) {
        const std::uint32_t bits = in_block[block] >> k & kAllLanes;
        visit(block * kBlockRays + k, mask_of(F16(), bits), at);
        at += static_cast<std::size_t>(std::popcount(bits));
      }
    }
    return at;
  }

  /// Precondition: they are `kMost` at most.
  HWY_INLINE void gather(const FanRays& fan, Blocks blocks, const std::uint32_t (&in_block)[kBlocks]) {
    count = each_vector(blocks, in_block, [&](std::size_t first, hn::Mask<F16> mask, std::size_t at) HWY_ATTR {
      const F16 f;
      const U16 whole;
      const auto numbers = hn::RebindMask(whole, mask);
      hn::StoreU(compress(f, hn::Load(f, fan.u + first), mask), f, u + at);
      hn::StoreU(compress(f, hn::Load(f, fan.v + first), mask), f, v + at);
      hn::StoreU(compress(f, hn::Load(f, fan.least + first), mask), f, least + at);
      hn::StoreU(compress(f, hn::Load(f, fan.sure + first), mask), f, sure + at);
      hn::StoreU(compress(whole, hn::Iota(whole, static_cast<std::uint32_t>(first)), numbers), whole, ray + at);
      if (fan.left) hn::StoreU(compress(whole, hn::Load(whole, fan.left + first), numbers), whole, left + at);
    });
  }

 private:
  static constexpr std::uint32_t kAllLanes = (1U << kLanes16) - 1;
};

}  // namespace tessera::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

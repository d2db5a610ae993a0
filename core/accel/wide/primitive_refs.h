#pragma once

#include <bit>
#include <cstdint>

#include "core/accel/wide/lanes.h"

namespace tessera {

/// A triangle, or a part of one, as builders know it: its box, and in the fourth lane of `hi` its number
/// (less than 2^30).
struct PrimitiveRef {
  /// Keeps the fourth lane a normal number: arithmetic on denormal ones is slow on some machines.
  static constexpr std::uint32_t kTag = 1U << 30;

  Lanes lo, hi;

  static PrimitiveRef of(const LanesBox& box, std::uint32_t triangle) {
    PrimitiveRef ref{box.lo, box.hi};
    ref.lo[3] = 0;
    ref.hi[3] = std::bit_cast<float>(triangle | kTag);
    return ref;
  }
  std::uint32_t triangle() const { return std::bit_cast<std::uint32_t>(hi[3]) & ~kTag; }
  /// Twice its box's middle.
  Lanes middle() const { return lo + hi; }
  LanesBox box() const { return {lo, hi}; }
};

}  // namespace tessera

#pragma once

#include <cstddef>
#include <cstdint>

#include <hwy/base.h>
#include <hwy/cache_control.h>

namespace tessera {

inline constexpr std::size_t kCacheLine = 64;

/// Asks for `count` cache lines, from the one that is `ahead` lines behind that of `from`. They needn't be ours. Calls
/// of functions that only prefetch g++ 12 takes to do nothing and drops, unless they are inlined before it looks: a
/// lambda here once left no prefetch in the program.
HWY_INLINE void prefetch_lines(const void* from, std::size_t count, std::size_t ahead = 0) {
  const auto at = reinterpret_cast<std::uintptr_t>(from) + ahead * kCacheLine;
  for (std::size_t i = 0; i < count; ++i) hwy::Prefetch(reinterpret_cast<const char*>(at + i * kCacheLine));
}

}  // namespace tessera

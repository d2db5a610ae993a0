#pragma once

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace tessera {

/// Switches flush-to-zero and denormals-are-zero on in this thread, and in those that it starts, for its scope.
class FlushToZero {
 public:
#if defined(__SSE__)
  static constexpr bool kKnown = true;  ///< Whether this machine's switch is known; without, nothing is done.
  FlushToZero() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040); }
  ~FlushToZero() { _mm_setcsr(before_); }
  FlushToZero(const FlushToZero&) = delete;
  FlushToZero& operator=(const FlushToZero&) = delete;

 private:
  unsigned before_;
#else
  static constexpr bool kKnown = false;
#endif
};

}  // namespace tessera

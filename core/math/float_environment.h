#pragma once

#include <cfenv>

namespace tessera {

/// For its scope, floats are computed as IEEE 754 has it by default, whatever the calling thread is set to: rounded to
/// nearest, denormals kept, no traps. Then the thread's own environment is back, flags included. What computes pixels,
/// or what they depend on, stands under one of these: hosts and libraries that flush denormals to zero for speed would
/// otherwise change images (law L1). Takes some 100 cycles.
///
/// The C library's default environment is what sets this: flushing to zero isn't the standard's matter, but glibc and
/// musl clear it along (MXCSR on x86, FPCR on arm64), and a test holds them to it.
class StrictFloats {
 public:
  StrictFloats();
  ~StrictFloats();
  StrictFloats(const StrictFloats&) = delete;
  StrictFloats& operator=(const StrictFloats&) = delete;

 private:
  std::fenv_t callers_;
};

}  // namespace tessera

#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>

namespace tessera {

/// Ends a fuzz target that has found a fault, which it says.
[[noreturn]] inline void fail(const std::string& fault) {
  std::fprintf(stderr, "%s\n", fault.c_str());
  std::abort();
}

inline void expect(bool holds, const std::string& otherwise) {
  if (!holds) fail(otherwise);
}

}  // namespace tessera

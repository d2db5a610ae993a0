#pragma once

#include <cstdlib>
#include <string_view>

namespace tessera {

/// Whether the suite runs at full length (`tests/run --long`): TESSERA_LONG_TESTS=1 in the environment.
inline bool long_tests() {
  const char* value = std::getenv("TESSERA_LONG_TESTS");
  return value != nullptr && std::string_view(value) == "1";
}

/// How many rays, scenes, … a test takes: a part of them in the ordinary run, all in the long one.
inline int effort(int ordinary, int full) { return long_tests() ? full : ordinary; }

}  // namespace tessera

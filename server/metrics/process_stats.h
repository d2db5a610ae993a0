#pragma once

#include <cstdint>

namespace tessera::server {

/// What the system says of this process (proc(5)); 0 where it doesn't say.
struct ProcessStats {
  double cpu_seconds = 0;
  double start_time = 0;  ///< Seconds since 1970.
  std::uint64_t resident_bytes = 0, virtual_bytes = 0;
  std::uint64_t open_files = 0, most_files = 0;
  std::uint64_t threads = 0;
};

/// Reads a few files of /proc. Descriptors are counted by listing them.
ProcessStats process_stats();

}  // namespace tessera::server

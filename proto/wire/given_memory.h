#pragma once

#include <cstdint>
#include <string>

namespace tessera::proto {

/// The memory that a process may take.
struct GivenMemory {
  std::uint64_t bytes;
  bool by_cgroup;  ///< Its cgroup, or one above it, has a limit that is tighter than the machine (cgroup v2).
};

/// Of the process of this id in /proc. For any thread.
GivenMemory given_memory(const std::string& process = "self");

}  // namespace tessera::proto

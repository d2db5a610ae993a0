#include "proto/wire/given_memory.h"

#include <filesystem>
#include <fstream>

#include <unistd.h>

namespace tessera::proto {
namespace fs = std::filesystem;

GivenMemory given_memory(const std::string& process) {
  const auto pages = static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES));
  GivenMemory given{pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)), false};
  std::ifstream groups("/proc/" + process + "/cgroup");
  for (std::string line; std::getline(groups, line);) {
    if (!line.starts_with("0::/")) continue;
    const fs::path root = "/sys/fs/cgroup";
    for (fs::path at = root / line.substr(4);; at = at.parent_path()) {
      std::uint64_t bytes = 0;
      if (std::ifstream limit(at / "memory.max"); limit >> bytes && bytes < given.bytes) given = {bytes, true};
      if (at == root || !at.has_relative_path()) break;
    }
  }
  return given;
}

}  // namespace tessera::proto

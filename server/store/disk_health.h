#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace tessera::server {

/// Whether a data folder can be written to at the moment.
struct DiskHealth {
  std::string problem;           ///< Empty where it can.
  std::uint64_t free_bytes = 0;  ///< Of its disk, that this process may take; 0 where that can't be told.
};

/// Asks the file system, and writes what leaves nothing there. Less than `least_free` bytes is a problem, too.
DiskHealth disk_health(const std::filesystem::path& data_dir, std::uint64_t least_free);

}  // namespace tessera::server

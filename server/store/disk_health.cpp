#include "server/store/disk_health.h"

#include <cerrno>
#include <system_error>

#include <sys/statvfs.h>
#include <unistd.h>

namespace tessera::server {

DiskHealth disk_health(const std::filesystem::path& data_dir, std::uint64_t least_free) {
  DiskHealth health;
  for (const std::filesystem::path& folder : {data_dir, data_dir / "blobs", data_dir / "scenes"}) {
    struct statvfs disk {};
    const std::string name =
        folder == data_dir ? "the data folder" : folder.filename().string() + "/ of the data folder";
    if (::statvfs(folder.c_str(), &disk) != 0) return {name + " is lost: " + std::generic_category().message(errno)};
    health.free_bytes = std::uint64_t{disk.f_bavail} * disk.f_frsize;
    if (::access(folder.c_str(), W_OK | X_OK) != 0)
      health.problem = name + " can't be written to: " + std::generic_category().message(errno);
    else if (health.free_bytes < least_free)
      health.problem = std::to_string(health.free_bytes) + " bytes are free, fewer than the " +
                       std::to_string(least_free) + " that --min-free-disk asks for";
    if (!health.problem.empty()) break;
  }
  return health;
}

}  // namespace tessera::server

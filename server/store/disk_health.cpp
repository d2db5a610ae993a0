#include "server/store/disk_health.h"

#include <array>
#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "server/store/file_descriptor.h"

namespace tessera::server {
namespace {

/// 0, or why nothing can be written into the folder.
int why_not_writable(const std::filesystem::path& folder) {
  const FileDescriptor file(::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600));
  if (file) {
    constexpr std::array<char, 4096> kSome{};
    return ::write(file.value(), kSome.data(), kSome.size()) == static_cast<ssize_t>(kSome.size()) ? 0 : ENOSPC;
  }
  // Not every file system has files without names, and a full or a lost one may say that first.
  if (errno != EOPNOTSUPP && errno != EISDIR && errno != EINVAL) return errno;
  return ::access(folder.c_str(), W_OK | X_OK) == 0 ? 0 : errno;
}

}  // namespace

DiskHealth disk_health(const std::filesystem::path& data_dir, std::uint64_t least_free) {
  DiskHealth health;
  for (const std::filesystem::path& folder : {data_dir, data_dir / "blobs", data_dir / "scenes"}) {
    struct statvfs disk {};
    const std::string name =
        folder == data_dir ? "the data folder" : folder.filename().string() + "/ of the data folder";
    if (::statvfs(folder.c_str(), &disk) != 0) return {name + " is lost: " + std::generic_category().message(errno)};
    health.free_bytes = std::uint64_t{disk.f_bavail} * disk.f_frsize;
    if (const int error = why_not_writable(folder))
      health.problem = name + " can't be written to: " + std::generic_category().message(error);
    else if (health.free_bytes < least_free)
      health.problem = std::to_string(health.free_bytes) + " bytes are free, fewer than the " +
                       std::to_string(least_free) + " that --min-free-disk asks for";
    if (!health.problem.empty()) break;
  }
  return health;
}

}  // namespace tessera::server

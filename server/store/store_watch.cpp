#include "server/store/store_watch.h"

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <spdlog/spdlog.h>
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

StoreWatch::StoreWatch(std::filesystem::path folder) : folder_(std::move(folder)) { look(); }

StoreHealth StoreWatch::health() const {
  const std::lock_guard lock(mutex_);
  return health_;
}

void StoreWatch::look() {
  struct statvfs space;
  const std::uint64_t free =
      ::statvfs(folder_.c_str(), &space) == 0 ? std::uint64_t{space.f_bavail} * space.f_frsize : 0;
  const int error = why_not_writable(folder_);
  const std::string problem = error == 0 ? "" : folder_.string() + ": " + std::generic_category().message(error);
  bool has_changed = false;
  {
    const std::lock_guard lock(mutex_);
    has_changed = health_.problem != problem;
    health_.writable = error == 0;
    health_.problem = problem;
    health_.free_bytes = free;
  }
  if (has_changed && error != 0) spdlog::error("files can't be kept: {}", problem);
  if (has_changed && error == 0) spdlog::info("files can be kept again in {}", folder_.string());
}

proto::Problem StoreWatch::refuse(const StorageError& error) {
  spdlog::error("{}", error.what());
  {
    const std::lock_guard lock(mutex_);
    health_.last_refusal = error.what();
    ++health_.refusals;
  }
  return storage_problem(error.code());
}

}  // namespace tessera::server

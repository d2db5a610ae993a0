#include "server/store/set_aside.h"

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

namespace tessera::server {
namespace fs = std::filesystem;

namespace {

std::atomic<std::uint64_t> set_aside_count{0};

/// What went wrong, or 0. Where the file system can't refuse to overwrite, looks first: names are only ever added here.
int move_to_free_name(const fs::path& from, const fs::path& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  struct stat there;
  if (::lstat(to.c_str(), &there) == 0) return EEXIST;
  return ::rename(from.c_str(), to.c_str()) == 0 ? 0 : errno;
}

}  // namespace

fs::path set_aside(const fs::path& damaged, const fs::path& folder, std::string_view why) {
  fs::path into = folder;
  const std::string name = damaged.parent_path().filename().string() + '-' + damaged.filename().string();
  for (unsigned number = 0;;) {
    if (::mkdir(into.c_str(), 0700) != 0 && errno != EEXIST)
      throw std::system_error(errno, std::generic_category(), "cannot make " + into.string());
    const fs::path to = into / (number == 0 ? name : name + '.' + std::to_string(number));
    const int error = move_to_free_name(damaged, to);
    if (error == 0) {
      ++set_aside_count;
      spdlog::error("{} is damaged: {}; set aside as {}", damaged.string(), why, to.string());
      return to;
    }
    if (error == EEXIST) {
      ++number;
    } else if (error == EXDEV && into == folder) {
      into = damaged.parent_path() / folder.filename();
    } else if (error == ENOENT) {
      return {};
    } else {
      throw std::system_error(error, std::generic_category(), "cannot set aside " + damaged.string());
    }
  }
}

std::uint64_t files_set_aside() { return set_aside_count; }

}  // namespace tessera::server

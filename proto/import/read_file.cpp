#include "proto/import/read_file.h"

#include <algorithm>
#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "proto/import/broken_file.h"
#include "proto/wire/abandoned.h"

namespace tessera::proto {
namespace {

constexpr std::uintmax_t kChunk = 1 << 20;

/// An input that is open as long as this lives.
class OpenInput {
 public:
  explicit OpenInput(const InputFile& file)
      : is_own_(file.descriptor < 0),
        fd_(is_own_ ? ::open(file.path.c_str(), O_RDONLY | O_CLOEXEC) : file.descriptor) {}
  ~OpenInput() {
    if (is_own_ && fd_ >= 0) ::close(fd_);
  }
  OpenInput(const OpenInput&) = delete;
  OpenInput& operator=(const OpenInput&) = delete;

  /// Of a regular file.
  std::optional<std::uintmax_t> size() const {
    struct stat about {};
    if (fd_ < 0 || ::fstat(fd_, &about) != 0 || !S_ISREG(about.st_mode)) return std::nullopt;
    return static_cast<std::uintmax_t>(about.st_size);
  }

  /// Whether there are so many from `offset` on. Others may read the same file.
  bool read(char* bytes, std::size_t count, std::uintmax_t offset) const {
    while (count > 0) {
      const ssize_t got = ::pread(fd_, bytes, count, static_cast<off_t>(offset));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return false;
      bytes += got;
      offset += static_cast<std::uintmax_t>(got);
      count -= static_cast<std::size_t>(got);
    }
    return true;
  }

 private:
  const bool is_own_;
  const int fd_;
};

}  // namespace

std::string read_file(const InputFile& file, std::string_view name, std::uintmax_t limit, const std::stop_token& stop) {
  const auto fail = [&](std::string detail) { throw BrokenFile{{{file_place(name, 0), std::move(detail)}}}; };
  const OpenInput input(file);
  const auto size = input.size();
  if (!size) fail("The file can't be opened");
  if (*size > limit) fail("The file is larger than " + std::to_string(limit >> 20) + " MiB");
  // Read, not mapped: a mapped file that somebody truncates would raise SIGBUS.
  std::string bytes;
  bytes.reserve(*size);
  while (bytes.size() < *size) {
    throw_if_abandoned(stop);
    const std::size_t begin = bytes.size();
    bytes.resize(std::min<std::uintmax_t>(*size, begin + kChunk));
    if (!input.read(bytes.data() + begin, bytes.size() - begin, begin)) fail("The file can't be read to its end");
  }
  return bytes;
}

FileKind kind_of(const InputFile& file) {
  const OpenInput input(file);
  const auto size = input.size();
  if (!size) return FileKind::unknown;
  std::string head(std::min<std::uintmax_t>(*size, kFileHead), '\0');
  if (!input.read(head.data(), head.size(), 0)) return FileKind::unknown;
  return file_kind(head, *size);
}

}  // namespace tessera::proto

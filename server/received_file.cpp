#include "server/received_file.h"

#include <cerrno>
#include <cstdlib>
#include <system_error>

#include <fcntl.h>

namespace tessera::server {
namespace {

[[noreturn]] void fail(const std::string& what) { throw std::system_error(errno, std::generic_category(), what); }

void sync_folder(const std::filesystem::path& folder) {
  const FileDescriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd || ::fsync(fd.value()) != 0) fail("cannot sync " + folder.string());
}

}  // namespace

ReceivedFile::ReceivedFile(const std::filesystem::path& folder) {
  std::string name = (folder / (std::string(kReceivedFilePrefix) + "XXXXXX")).string();
  file_ = FileDescriptor(::mkostemp(name.data(), O_CLOEXEC));
  if (!file_) fail("cannot create a file in " + folder.string());
  path_ = name;
}

ReceivedFile::~ReceivedFile() {
  if (!path_.empty()) ::unlink(path_.c_str());
}

void ReceivedFile::write(std::span<const std::byte> bytes) {
  sha256_.update(bytes);
  size_ += bytes.size();
  while (!bytes.empty()) {
    const ssize_t written = ::write(file_.value(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail("cannot write " + path_.string());
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

const proto::ContentHash& ReceivedFile::finish() {
  if (hash_.empty()) hash_ = sha256_.finish();
  return hash_;
}

void ReceivedFile::keep_as(const std::filesystem::path& destination) {
  if (::fsync(file_.value()) != 0) fail("cannot sync " + path_.string());
  if (::rename(path_.c_str(), destination.c_str()) != 0) fail("cannot rename to " + destination.string());
  path_.clear();
  sync_folder(destination.parent_path());
}

}  // namespace tessera::server

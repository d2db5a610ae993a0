#include "server/store/received_file.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <stdexcept>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>

#include "server/store/storage_error.h"

namespace tessera::server {

void sync_folder(const std::filesystem::path& folder) {
  const FileDescriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd || ::fsync(fd.value()) != 0) throw_storage_error("cannot sync " + folder.string());
}

ReceivedFile::ReceivedFile(std::filesystem::path folder) : folder_(std::move(folder)) {}

ReceivedFile::~ReceivedFile() {
  if (!mapped_.empty()) ::munmap(const_cast<char*>(mapped_.data()), mapped_.size());
  if (!path_.empty()) ::unlink(path_.c_str());
}

void ReceivedFile::create() {
  std::string name = (folder_ / (std::string(kReceivedFilePrefix) + "XXXXXX")).string();
  file_ = FileDescriptor(::mkostemp(name.data(), O_CLOEXEC));
  if (!file_) throw_storage_error("cannot create a file in " + folder_.string());
  path_ = name;
  write_out(std::as_bytes(std::span(memory_)));
}

void ReceivedFile::write(std::span<const std::byte> bytes) {
  if (is_whole_) throw std::logic_error("written to after it was read");
  size_ += bytes.size();
  if (!file_ && memory_.size() + bytes.size() <= kMostInMemory) {
    memory_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return;
  }
  put_on_disk();
  sha256_.update(bytes);
  write_out(bytes);
}

void ReceivedFile::put_on_disk() {
  if (file_) return;
  create();
  sha256_.update(memory_);
  memory_ = {};
}

void ReceivedFile::write_out(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file_.value(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw_storage_error("cannot write " + path_.string());
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

const proto::ContentHash& ReceivedFile::finish() {
  is_whole_ = true;
  if (!hash_.empty()) return hash_;
  sha256_.update(memory_);
  return hash_ = sha256_.finish();
}

std::string ReceivedFile::head(std::size_t most) const {
  if (memory_.size() == size_) return memory_.substr(0, most);
  std::string bytes(std::min<std::uint64_t>(most, size_), '\0');
  std::size_t there = 0;
  while (there < bytes.size()) {
    const ssize_t count = ::pread(file_.value(), bytes.data() + there, bytes.size() - there, static_cast<off_t>(there));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw_storage_error("cannot read " + path_.string());
    there += static_cast<std::size_t>(count);
  }
  return bytes;
}

std::string_view ReceivedFile::content() {
  is_whole_ = true;
  if (memory_.size() == size_) return memory_;
  if (mapped_.empty()) {
    void* address = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, file_.value(), 0);
    if (address == MAP_FAILED) throw_storage_error("cannot map " + path_.string());
    mapped_ = {static_cast<const char*>(address), size_};
  }
  return mapped_;
}

const std::filesystem::path& ReceivedFile::path() {
  is_whole_ = true;
  if (!file_) create();
  return path_;
}

void ReceivedFile::keep_as(const std::filesystem::path& destination, std::mutex* naming) {
  is_whole_ = true;
  if (!file_) create();
  if (::fsync(file_.value()) != 0) throw_storage_error("cannot sync " + path_.string());
  {
    const std::unique_lock lock = naming ? std::unique_lock(*naming) : std::unique_lock<std::mutex>();
    if (::rename(path_.c_str(), destination.c_str()) != 0)
      throw_storage_error("cannot rename to " + destination.string());
  }
  path_.clear();
  sync_folder(destination.parent_path());
}

}  // namespace tessera::server

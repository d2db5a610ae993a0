#pragma once

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <span>
#include <string>
#include <string_view>

#include "proto/wire/sha256.h"
#include "server/store/file_descriptor.h"

namespace tessera::server {

/// A file that comes in: hashed as it grows, in memory as long as it is small, from then on in a temporary file that
/// vanishes unless it is kept. One thread at a time. Every failure of the file system is a StorageError.
class ReceivedFile {
 public:
  static constexpr std::size_t kMostInMemory = 256 << 10;

  /// Starts an empty file, to be put into `folder`, which is on the file system where it will be kept.
  explicit ReceivedFile(std::filesystem::path folder);
  ~ReceivedFile();
  ReceivedFile(const ReceivedFile&) = delete;
  ReceivedFile& operator=(const ReceivedFile&) = delete;

  void write(std::span<const std::byte> bytes);
  /// Whether so many bytes more leave it in memory: then writing them takes neither time nor the disk.
  bool has_memory_for(std::size_t bytes) const { return !file_ && memory_.size() + bytes <= kMostInMemory; }
  /// Takes it out of memory.
  void put_on_disk();
  std::size_t bytes_in_memory() const { return memory_.size(); }
  std::uint64_t size() const { return size_; }

  /// The first bytes, at most so many.
  std::string head(std::size_t most) const;

  // After any of these a `write` is a std::logic_error.

  /// The hash of everything written.
  const proto::ContentHash& finish();

  /// Everything written, as long as this lives; not to be asked for once it is kept.
  std::string_view content();

  /// Where the file lies on the disk, which it does from now on at the latest.
  const std::filesystem::path& path();

  /// Puts the file at `destination`, all of it or none, to outlive a power cut. It gets that name while `naming`, where
  /// there is one, is held.
  void keep_as(const std::filesystem::path& destination, std::mutex* naming = nullptr);

 private:
  void create();
  void write_out(std::span<const std::byte> bytes);

  const std::filesystem::path folder_;
  std::string memory_;          ///< All of a small file.
  std::filesystem::path path_;  ///< Empty before there is a file, and once it is kept.
  FileDescriptor file_;
  std::uint64_t size_ = 0;
  bool is_whole_ = false;
  proto::Sha256 sha256_;  ///< Of what isn't in memory.
  proto::ContentHash hash_;
  std::string_view mapped_;
};

/// What small files that come together may take of memory; those beyond go to the disk.
class MemoryOfFiles {
 public:
  static constexpr std::size_t kMost = 8 << 20;

  /// To be called once all of the file is written.
  void settle(ReceivedFile& file) {
    if (file.bytes_in_memory() > left_) file.put_on_disk();
    left_ -= file.bytes_in_memory();
  }

 private:
  std::size_t left_ = kMost;
};

/// Has what was renamed or made in a folder outlive a power cut. Throws std::system_error.
void sync_folder(const std::filesystem::path& folder);

/// Names that `ReceivedFile` gives begin so; whatever is left of them when a daemon starts is from a crash.
inline constexpr std::string_view kReceivedFilePrefix = ".receiving-";

}  // namespace tessera::server

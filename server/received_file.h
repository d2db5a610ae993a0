#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "proto/wire/sha256.h"
#include "server/file_descriptor.h"

namespace tessera::server {

/// Bytes on their way to the disk: a temporary file that is hashed as it grows, and that vanishes unless it is
/// kept. One thread at a time. Every failure of the file system is a std::system_error.
class ReceivedFile {
 public:
  /// Starts an empty file in `folder`, which is on the file system where it will be kept.
  explicit ReceivedFile(const std::filesystem::path& folder);
  ~ReceivedFile();
  ReceivedFile(const ReceivedFile&) = delete;
  ReceivedFile& operator=(const ReceivedFile&) = delete;

  void write(std::span<const std::byte> bytes);
  std::uint64_t size() const { return size_; }

  /// The hash of everything written; no `write` may follow.
  const proto::ContentHash& finish();

  /// Puts the file at `destination`, all of it or none, to outlive a power cut.
  void keep_as(const std::filesystem::path& destination);

 private:
  std::filesystem::path path_;  ///< Empty once kept.
  FileDescriptor file_;
  std::uint64_t size_ = 0;
  proto::Sha256 sha256_;
  proto::ContentHash hash_;
};

/// Names that `ReceivedFile` gives begin so; whatever is left of them when a daemon starts is from a crash.
inline constexpr std::string_view kReceivedFilePrefix = ".receiving-";

}  // namespace tessera::server

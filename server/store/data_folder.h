#pragma once

#include <filesystem>

#include "server/store/file_descriptor.h"

namespace tessera::server {

/// The daemon's folder on disk, locked against a second daemon for as long as this lives.
class DataFolder {
 public:
  /// Makes what is missing and removes what a crash has left half-received. Throws std::runtime_error when another
  /// daemon has it, std::system_error when the file system refuses.
  explicit DataFolder(const std::filesystem::path& path);

  const std::filesystem::path& blobs() const { return blobs_; }
  const std::filesystem::path& scenes() const { return scenes_; }
  const std::filesystem::path& owners() const { return owners_; }
  const std::filesystem::path& images() const { return images_; }
  /// These needn't exist.
  const std::filesystem::path& tiles() const { return tiles_; }
  /// Where damaged files go (`set_aside`).
  const std::filesystem::path& set_aside() const { return set_aside_; }
  const std::filesystem::path& journal() const { return journal_; }

  /// Whether there is what only jobs leave, which the journal has to know of.
  bool has_traces_of_jobs() const;

 private:
  std::filesystem::path blobs_, scenes_, owners_, images_, tiles_, set_aside_, journal_;
  FileDescriptor lock_;
};

}  // namespace tessera::server

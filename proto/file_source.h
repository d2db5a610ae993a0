#pragma once

#include <filesystem>
#include <memory>
#include <stop_token>
#include <string_view>

#include "proto/asset_reader.h"
#include "proto/wire/result.h"
#include "proto/wire/sha256.h"

namespace tessera::proto {

/// A file that a scene document names, found.
struct SourceFile {
  std::filesystem::path path;
  ContentHash hash;
  std::shared_ptr<const void> hold = nullptr;  ///< As long as it is there, the file is.
};

/// Where the parser finds the files that a scene names. Problems come without a pointer: the parser adds it.
/// Safe to call from any number of threads.
class FileSource {
 public:
  virtual ~FileSource() = default;

  /// An uploaded blob, whose bytes may have to be looked at first, which takes its time: a stop ends that, with any
  /// problem or with `Abandoned`.
  virtual Result<SourceFile> blob(const ContentHash& hash, const std::stop_token& stop) const = 0;

  /// A file under the asset root, by relative path. Refuses absolute paths, paths that climb out of the root
  /// (also by symbolic links), and anything that isn't a regular file. Hashes it, which takes its time: a stop ends
  /// that, with any problem.
  virtual Result<SourceFile> asset(std::string_view relative_path, const std::stop_token& stop) const = 0;

  /// What reads the files that are found. Lives as long as this.
  virtual const AssetReader& reader() const = 0;
};

}  // namespace tessera::proto

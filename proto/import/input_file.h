#pragma once

#include <compare>
#include <filesystem>
#include <utility>

namespace tessera::proto {

/// A file that is read: by its path, or one that others have opened, for those who may open none.
struct InputFile {
  InputFile() = default;  ///< None: it can't be opened.
  InputFile(std::filesystem::path file) : path(std::move(file)) {}
  /// Another path is another file.
  InputFile(std::filesystem::path file, int open_file) : path(std::move(file)), descriptor(open_file) {}

  std::filesystem::path path;
  int descriptor = -1;  ///< Stays open as long as it may be read; -1 where the path is to be opened.
};

}  // namespace tessera::proto

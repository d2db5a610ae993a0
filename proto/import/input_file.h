#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

namespace tessera::proto {

/// A file that is read: by its path, or where others have opened it, for those who may open none.
struct InputFile {
  InputFile() = default;  ///< None: it can't be opened.
  InputFile(std::filesystem::path file) : path(std::move(file)) {}
  /// The bytes stay where they are as long as `opened` lives.
  InputFile(std::filesystem::path file, std::string_view bytes, std::shared_ptr<const void> opened)
      : path(std::move(file)), content(bytes), hold(std::move(opened)) {}

  std::filesystem::path path;               ///< Another one is another file.
  std::optional<std::string_view> content;  ///< Nothing where the path is to be opened.
  std::shared_ptr<const void> hold;
};

}  // namespace tessera::proto

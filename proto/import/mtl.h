#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/material.h"
#include "proto/import/import.h"
#include "proto/wire/material_libraries.h"

namespace tessera::proto {

/// The materials of the MTL libraries that one OBJ file names.
class MtlLibraries {
 public:
  static constexpr std::uintmax_t kLargestFile = 16ULL << 20;
  /// Beyond this an OBJ file's libraries are ignored, with a warning.
  static constexpr std::uintmax_t kMostBytes = 2 * kLargestFile;

  explicit MtlLibraries(const CompanionSource& companions)
      : companions_(companions), search_([this](const std::string& name) { return load_file(name); }) {}

  /// Loads the libraries of a mtllib statement. False when one isn't there or can't be read.
  bool load(std::string_view arguments);

  /// Into `materials`; nothing for a name that no library has. The first library that has a name wins.
  std::optional<std::uint32_t> find(std::string_view name) const;

  std::vector<Material> materials;
  std::vector<SceneWarning> warnings;

 private:
  bool load_file(const std::string& name);
  void load_text(std::string text, std::string_view name);

  const CompanionSource& companions_;
  LibrarySearch search_;
  bool can_read_all_ = true;
  std::uintmax_t bytes_left_ = kMostBytes;
  std::map<std::string, std::uint32_t, std::less<>> by_name_;
};

/// Without the blanks at both ends.
std::string_view trimmed(std::string_view text);

}  // namespace tessera::proto

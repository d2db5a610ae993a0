#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/material.h"
#include "proto/import/import.h"

namespace tessera::proto {

/// The materials of the MTL libraries that one OBJ file names.
class MtlLibraries {
 public:
  /// Beyond these an OBJ file's libraries are ignored, with a warning.
  static constexpr std::size_t kMostLookedFor = 64;
  static constexpr std::uintmax_t kLargestFile = 16ULL << 20;

  explicit MtlLibraries(const CompanionSource& companions) : companions_(companions) {}

  /// Loads the libraries of a mtllib statement: names between blanks, or names that hold blanks themselves. False
  /// when one isn't there or can't be read. A name that was looked for before counts as it did then.
  bool load(std::string_view names);

  /// Into `materials`; nothing for a name that no library has. The first library that has a name wins.
  std::optional<std::uint32_t> find(std::string_view name) const;

  std::vector<Material> materials;
  std::vector<SceneWarning> warnings;

 private:
  bool load_file(const std::string& name);
  void load_text(std::string text, std::string_view name);

  const CompanionSource& companions_;
  std::map<std::string, bool> looked_for_;
  std::map<std::string, std::uint32_t, std::less<>> by_name_;
};

/// Without the blanks at both ends.
std::string_view trimmed(std::string_view text);

}  // namespace tessera::proto

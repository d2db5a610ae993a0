#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/scene/scene.h"

namespace tessera::proto {

/// Gathers what an import loses or ignores: one warning per kind, with the number of times and the first place. Of
/// kinds beyond `kMostKinds`, as files can name things without end, only their number is told.
class ImportNotes {
 public:
  static constexpr std::size_t kMostKinds = 100;

  /// Places are lines of a file.
  explicit ImportNotes(std::string_view file_name);

  /// Places are what `name_of` says of them.
  explicit ImportNotes(std::function<std::string(std::size_t place)> name_of) : name_of_(std::move(name_of)) {}

  /// `what` is a sentence without its full stop; equal sentences are counted together. Nothing for 0 times.
  void add(std::string_view what, std::size_t place = 0, std::uint64_t times = 1);

  /// In the order of first occurrence.
  std::vector<SceneWarning> warnings() const;

 private:
  struct Note {
    std::string what;
    std::size_t first_place;
    std::uint64_t times;
  };
  std::function<std::string(std::size_t)> name_of_;
  std::vector<Note> notes_;
  std::map<std::string, std::size_t, std::less<>> positions_;  ///< In `notes_`, by what they say.
  Note others_{"Other things are ignored or lost, too", 0, 0};
};

}  // namespace tessera::proto

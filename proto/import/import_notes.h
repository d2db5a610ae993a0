#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/scene.h"

namespace tessera::proto {

/// Gathers what an import loses or ignores: one warning per kind, with the number of times and the first place.
class ImportNotes {
 public:
  explicit ImportNotes(std::string_view file_name) : file_name_(file_name) {}

  /// `what` is a sentence without its full stop; equal sentences are counted together. Nothing for 0 times.
  void add(std::string_view what, std::size_t line = 0, std::uint64_t times = 1);

  /// In the order of first occurrence.
  std::vector<SceneWarning> warnings() const;

 private:
  struct Note {
    std::string what;
    std::size_t first_line;
    std::uint64_t times;
  };
  std::string file_name_;
  std::vector<Note> notes_;
};

}  // namespace tessera::proto

#include "proto/import/import_notes.h"

#include <algorithm>

#include "proto/import/broken_file.h"

namespace tessera::proto {

ImportNotes::ImportNotes(std::string_view file_name)
    : name_of_([file_name = std::string(file_name)](std::size_t line) { return file_place(file_name, line); }) {}

void ImportNotes::add(std::string_view what, std::size_t place, std::uint64_t times) {
  if (times == 0) return;
  const auto known = std::find_if(notes_.begin(), notes_.end(), [&](const Note& n) { return n.what == what; });
  if (known == notes_.end()) {
    notes_.push_back({std::string(what), place, times});
  } else {
    known->times += times;
  }
}

std::vector<SceneWarning> ImportNotes::warnings() const {
  std::vector<SceneWarning> warnings;
  for (const Note& note : notes_) {
    const std::string count = note.times == 1 ? "" : " (" + std::to_string(note.times) + " times)";
    warnings.push_back({name_of_(note.first_place), note.what + count});
  }
  return warnings;
}

}  // namespace tessera::proto

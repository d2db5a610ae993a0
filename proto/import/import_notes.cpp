#include "proto/import/import_notes.h"

#include <algorithm>

#include "proto/import/broken_file.h"

namespace tessera::proto {

void ImportNotes::add(std::string_view what, std::size_t line, std::uint64_t times) {
  if (times == 0) return;
  const auto known = std::find_if(notes_.begin(), notes_.end(), [&](const Note& n) { return n.what == what; });
  if (known == notes_.end()) {
    notes_.push_back({std::string(what), line, times});
  } else {
    known->times += times;
  }
}

std::vector<SceneWarning> ImportNotes::warnings() const {
  std::vector<SceneWarning> warnings;
  for (const Note& note : notes_) {
    const std::string count = note.times == 1 ? "" : " (" + std::to_string(note.times) + " times)";
    warnings.push_back({file_place(file_name_, note.first_line), note.what + count});
  }
  return warnings;
}

}  // namespace tessera::proto

#include "proto/import/import_notes.h"

#include "proto/import/broken_file.h"

namespace tessera::proto {

ImportNotes::ImportNotes(std::string_view file_name)
    : name_of_([file_name = std::string(file_name)](std::size_t line) { return file_place(file_name, line); }) {}

void ImportNotes::add(std::string_view what, std::size_t place, std::uint64_t times) {
  if (times == 0) return;
  if (const auto known = positions_.find(what); known != positions_.end()) {
    notes_[known->second].times += times;
  } else if (notes_.size() < kMostKinds) {
    positions_.emplace(what, notes_.size());
    notes_.push_back({std::string(what), place, times});
  } else {
    if (others_.times == 0) others_.first_place = place;
    others_.times += times;
  }
}

std::vector<SceneWarning> ImportNotes::warnings() const {
  std::vector<SceneWarning> warnings;
  const auto tell = [&](const Note& note) {
    const std::string count = note.times == 1 ? "" : " (" + std::to_string(note.times) + " times)";
    warnings.push_back({name_of_(note.first_place), note.what + count});
  };
  for (const Note& note : notes_) tell(note);
  if (others_.times > 0) tell(others_);
  return warnings;
}

}  // namespace tessera::proto

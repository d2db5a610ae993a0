#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "server/store/journal.h"

namespace tessera::server {

/// What a journal was found to be.
struct JournalCheck {
  std::string damage;  ///< Empty where it is whole; else it was set aside, and there is a new one.
  std::uint64_t bytes = 0;
  std::uint64_t entries = 0, images = 0;  ///< That there are: of one that was damaged, in the new one.
};

/// Looks through all of a journal that no daemon has open. One that is damaged goes to `set_aside`, with its log, and a
/// new one gets all the entries that can still be read and are what was written, by their numbers, and the images of
/// their jobs. A damaged page takes no more with it than what stands on it, or in the tree below it: so nothing is
/// found where the tree of entries has its root. Throws std::runtime_error where it can't be used otherwise, or the
/// disk refuses; then it is as it was.
JournalCheck check_journal(const std::filesystem::path& file, Journal::Missing missing,
                           const std::filesystem::path& set_aside);

}  // namespace tessera::server

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace tessera::server {

/// The size of the journal's pages.
inline constexpr std::size_t kJournalPage = 4096;

/// A page of a database in a newer version.
struct LoggedPage {
  std::uint32_t number;  ///< From 1.
  std::span<const char, kJournalPage> bytes;
  bool is_whole;
};

/// What is in the write-ahead log of an SQLite database (sqlite.org/fileformat2.html, 4).
struct WriteAheadLog {
  /// Empty for one that is whole, or ends in what a killed daemon or a power cut has left half written. SQLite takes
  /// all that follows the first frame that isn't whole for that, and passes over it without a word. But each
  /// transaction is on the disk before the next is begun: so where two or more follow, frames were damaged later.
  std::string damage;
  /// Views of the log: the pages of all transactions in their order, damaged ones and those behind them included.
  std::vector<LoggedPage> pages;
};

/// The log has to stay where it is as long as the pages are used.
WriteAheadLog read_write_ahead_log(const std::string& log);

}  // namespace tessera::server

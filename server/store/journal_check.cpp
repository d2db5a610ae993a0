#include "server/store/journal_check.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "server/store/journal_database.h"
#include "server/store/received_file.h"
#include "server/store/set_aside.h"
#include "server/store/write_ahead_log.h"

namespace tessera::server {
namespace fs = std::filesystem;
using Error = JournalDatabase::Error;

namespace {

std::string whole_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write_whole_file(const fs::path& path, std::string_view bytes) {
  std::ofstream file(path, std::ios::binary);
  file << bytes;
  file.close();
  if (!file) throw std::system_error(errno, std::generic_category(), "cannot write " + path.string());
}

fs::path with(const fs::path& file, const char* ending) { return file.string() + ending; }

void remove_database(const fs::path& file) {
  for (const char* ending : {"", "-wal", "-shm", "-journal"}) fs::remove(with(file, ending));
}

/// What is wrong with a journal, or nothing, and how much there is in it.
JournalCheck look_through(const fs::path& file, Journal::Missing missing) {
  JournalCheck check;
  try {
    const auto database = open_journal(file, missing);
    check.damage = database->text("PRAGMA integrity_check(1)");
    if (check.damage == "ok") check.damage.clear();
    constexpr std::size_t kAtOnce = 1000;
    std::uint64_t last = 0;
    for (auto entries = database->since(last, kAtOnce); !entries.empty(); entries = database->since(last, kAtOnce)) {
      check.entries += entries.size();
      last = entries.back().seq;
    }
    check.images = database->images().size();
  } catch (const DamagedJournal& damage) {
    check.damage = damage.why;
  } catch (const Error& error) {
    if (error.kind != Error::Kind::damage) throw;
    check.damage = error.what();
  }
  for (const char* ending : {"", "-wal"}) {
    std::error_code none;
    const std::uintmax_t bytes = fs::file_size(with(file, ending), none);
    if (!none) check.bytes += bytes;
  }
  return check;
}

constexpr std::size_t kVersions = 18, kChangeCounter = 24, kPageCount = 28, kFreePages = 32, kValidFor = 92;

/// Puts pages of the log into the database, as SQLite would, but also those behind a damaged one.
void apply_log(std::string& database, const std::string& log) {
  const WriteAheadLog read = read_write_ahead_log(log);
  const std::size_t most = database.size() / kJournalPage + read.pages.size();
  for (const LoggedPage& page : read.pages) {
    if (page.number == 0 || page.number > most) continue;
    const std::size_t begin = std::size_t{page.number - 1} * kJournalPage;
    database.resize(std::max(database.size(), begin + kJournalPage), '\0');
    std::ranges::copy(page.bytes, database.begin() + static_cast<std::ptrdiff_t>(begin));
  }
}

/// Has the header say that there is no log, and as many pages as there are.
void settle_header(std::string& database) {
  database.resize((database.size() + kJournalPage - 1) / kJournalPage * kJournalPage, '\0');
  if (database.empty()) return;
  database[kVersions] = database[kVersions + 1] = '\1';
  const std::size_t pages = database.size() / kJournalPage;
  for (std::size_t i = 0; i < 4; ++i) {
    database[kPageCount + i] = static_cast<char>(pages >> 8 * (3 - i) & 0xFF);
    database[kValidFor + i] = database[kChangeCounter + i];
  }
  std::fill_n(database.begin() + kFreePages, 8, '\0');
}

bool is_without_hashes(JournalDatabase& database) { return database.number("PRAGMA user_version") <= kWithoutHashes; }

bool knows_its_tables(const fs::path& file) {
  try {
    JournalDatabase database(file, JournalDatabase::Open::write);
    if (is_without_hashes(database)) database.try_to_run("ALTER TABLE events ADD COLUMN hash INTEGER");
    database.text("SELECT seq, hash FROM events LIMIT 0");
    return true;
  } catch (const Error&) {
    return false;
  }
}

/// Reads what can still be read of a damaged journal.
class Salvage {
 public:
  Salvage(const fs::path& damaged, JournalDatabase& made) : from_(damaged, JournalDatabase::Open::read), made_(made) {
    from_.expect_hashes(!is_without_hashes(from_));
  }

  void carry_over(JournalCheck& check) {
    check.entries = check.images = 0;
    std::set<std::string> jobs;
    made_.run("BEGIN IMMEDIATE");
    for (std::uint64_t seq = 0; const auto next = find_next(seq);) {
      seq = *next;
      const auto entry = read(seq);
      if (!entry) continue;
      Journal::Append append{entry->job, entry->kind, entry->time, nullptr};
      made_.insert(seq, append, entry->body);
      jobs.insert(entry->job);
      ++check.entries;
    }
    for (const std::string& job : jobs) {
      const auto image = image_of(job);
      if (!image) continue;
      made_.insert_image(job, *image);
      ++check.images;
    }
    made_.run("COMMIT");
  }

 private:
  /// The next number that can be found. Where a page of the tree is damaged, it is looked for behind that: number by
  /// number for as many as a page may hold the way to, and then in larger and larger steps.
  std::optional<std::uint64_t> find_next(std::uint64_t after) {
    constexpr std::uint64_t kEach = 10'000;
    constexpr auto kLast = static_cast<std::uint64_t>(kLastEntry);
    for (std::uint64_t tries = 0, step = 1; after < kLast; ++tries) {
      try {
        const auto next = from_.next(after);
        return next && *next > after && *next <= kLast ? next : std::nullopt;
      } catch (const Error&) {
        if (tries > kEach) step *= 2;
        after += step;
      }
    }
    return std::nullopt;
  }

  std::optional<JournalEntry> read(std::uint64_t seq) {
    try {
      auto entries = from_.since(seq - 1, 1);
      if (!entries.empty() && entries.front().seq == seq) return std::move(entries.front());
    } catch (const Error&) {
    }
    return std::nullopt;
  }

  std::optional<std::string> image_of(const std::string& job) {
    try {
      return from_.image(job);
    } catch (const Error&) {
      return std::nullopt;
    }
  }

  JournalDatabase from_;
  JournalDatabase& made_;
};

/// Makes a journal at `made` of what can be read of `file`.
void salvage(const fs::path& file, const fs::path& made, JournalCheck& check) {
  const fs::path copy = with(file, ".damaged");
  remove_database(copy);
  remove_database(made);
  {
    open_journal(made, Journal::Missing::is_new);  // As its file is whole once it is closed.
  }
  std::string database = whole_file(file);
  apply_log(database, whole_file(with(file, "-wal")));
  settle_header(database);
  write_whole_file(copy, database);
  if (!knows_its_tables(copy)) {
    // Every journal's tables begin at the same pages, which is what the first page says.
    const std::string first = whole_file(made).substr(0, kJournalPage);
    database.resize(std::max(database.size(), first.size()), '\0');
    std::ranges::copy(first, database.begin());
    settle_header(database);
    write_whole_file(copy, database);
  }
  if (knows_its_tables(copy)) Salvage(copy, *open_journal(made, Journal::Missing::is_lost)).carry_over(check);
  remove_database(copy);
}

}  // namespace

JournalCheck check_journal(const fs::path& file, Journal::Missing missing, const fs::path& aside) {
  const fs::path made = with(file, kSalvagedJournal);
  JournalCheck check = look_through(file, missing);
  if (check.damage.empty()) return check;
  if (fs::exists(file) || !fs::exists(made)) salvage(file, made, check);  // Or it was, and then this ended.
  for (const char* ending : {"", "-wal"})
    if (fs::exists(with(file, ending))) set_aside(with(file, ending), aside, check.damage);
  remove_database(file);
  fs::rename(made, file);
  sync_folder(fs::absolute(file).parent_path());
  return check;
}

}  // namespace tessera::server

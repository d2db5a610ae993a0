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
#include <vector>

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
    database->keep_log(true);
    check.damage = database->text("PRAGMA integrity_check(1)");
    if (check.damage == "ok") check.damage.clear();
    check.entries = static_cast<std::uint64_t>(database->number("SELECT count(*) FROM events"));
    check.images = database->images().size();
    database->keep_log(!check.damage.empty());
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
void apply_log(std::string& database, const WriteAheadLog& log, bool with_damaged) {
  const std::size_t most = database.size() / kJournalPage + log.pages.size();
  for (const LoggedPage& page : log.pages) {
    if (page.number == 0 || page.number > most || !(page.is_whole || with_damaged)) continue;
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

  void carry_over() {
    std::set<std::string> jobs;
    made_.run("BEGIN IMMEDIATE");
    for (std::uint64_t after = 0; after < kLast;) {
      const Part part = read(after);
      for (const JournalEntry& entry : part.entries) {
        made_.insert(entry.seq, {entry.job, entry.kind, entry.time, nullptr}, entry.body);
        jobs.insert(entry.job);
      }
      if (part.is_last) break;
      after = leads_on(part, after) ? part.entries.back().seq : find_way_on(after);
    }
    for (const std::string& job : jobs)
      if (const auto image = image_of(job)) made_.insert_image(job, *image);
    made_.run("COMMIT");
  }

 private:
  static constexpr auto kLast = static_cast<std::uint64_t>(kLastEntry);

  struct Part {
    std::vector<JournalEntry> entries;  ///< Those that are what was written.
    bool is_last = false;
  };

  /// What follows a number, up to where the tree can't be followed.
  Part read(std::uint64_t after) {
    constexpr std::size_t kAtOnce = 100;
    Part part;
    std::size_t rows = 0;
    try {
      from_.walk(after, kAtOnce, [&](JournalEntry&& entry, bool is_whole) {
        ++rows;
        if (is_whole && entry.seq > 0 && entry.seq <= kLast) part.entries.push_back(std::move(entry));
      });
      part.is_last = rows < kAtOnce;
    } catch (const Error&) {
    }
    return part;
  }

  static bool leads_on(const Part& part, std::uint64_t after) {
    return !part.entries.empty() && part.entries.back().seq > after;
  }

  bool can_go_on(std::uint64_t after) {
    const Part part = read(after);
    return part.is_last || leads_on(part, after);
  }

  /// The first number behind a damaged page, or `kLast`: looked for number by number for as many as a page may hold the
  /// way to, and then in larger and larger steps, of which the last is halved.
  std::uint64_t find_way_on(std::uint64_t damaged) {
    constexpr std::uint64_t kEach = 10'000;
    std::uint64_t after = damaged;
    for (std::uint64_t tries = 0, step = 1; after < kLast; ++tries) {
      if (tries > kEach) step *= 2;
      after = std::min(damaged + step, kLast);
      if (can_go_on(after)) break;
      damaged = after;
    }
    while (after - damaged > 1) {
      const std::uint64_t middle = damaged + (after - damaged) / 2;
      (can_go_on(middle) ? after : damaged) = middle;
    }
    return after;
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
void salvage(const fs::path& file, const fs::path& made) {
  const fs::path copy = with(file, ".damaged");
  remove_database(copy);
  remove_database(made);
  {
    open_journal(made, Journal::Missing::is_new);  // As its file is whole once it is closed.
  }
  // Every journal's tables begin at the same pages, which is what the first page says.
  const std::string first = whole_file(made).substr(0, kJournalPage);
  const std::string bytes = whole_file(with(file, "-wal"));
  const WriteAheadLog log = read_write_ahead_log(bytes);
  const auto writing = open_journal(made, Journal::Missing::is_lost);
  // There may be more to read on a page of the log that is damaged, or on the older one below it: so of both.
  for (const bool with_damaged : {true, false}) {
    if (!with_damaged && std::ranges::all_of(log.pages, &LoggedPage::is_whole)) break;
    std::string database = whole_file(file);
    apply_log(database, log, with_damaged);
    settle_header(database);
    write_whole_file(copy, database);
    if (!knows_its_tables(copy)) {
      database.resize(std::max(database.size(), first.size()), '\0');
      std::ranges::copy(first, database.begin());
      settle_header(database);
      write_whole_file(copy, database);
    }
    if (knows_its_tables(copy)) Salvage(copy, *writing).carry_over();
    remove_database(copy);
  }
  writing->write_back();  // Closing does that, too, but doesn't tell where it fails.
}

}  // namespace

JournalCheck check_journal(const fs::path& file, Journal::Missing missing, const fs::path& aside) {
  const fs::path made = with(file, kSalvagedJournal);
  JournalCheck check = look_through(file, missing);
  if (check.damage.empty()) return check;
  if (fs::exists(file) || !fs::exists(made)) salvage(file, made);  // Or it was, and then this ended.
  for (const char* ending : {"", "-wal"})
    if (fs::exists(with(file, ending))) set_aside(with(file, ending), aside, check.damage);
  remove_database(file);
  fs::rename(made, file);
  sync_folder(fs::absolute(file).parent_path());
  const JournalCheck now = look_through(file, Journal::Missing::is_lost);
  if (!now.damage.empty()) throw DamagedJournal(file, now.damage);
  check.entries = now.entries;
  check.images = now.images;
  return check;
}

}  // namespace tessera::server

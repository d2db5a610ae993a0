#include "server/store/journal_check.h"

#include <filesystem>
#include <fstream>
#include <future>
#include <iterator>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPage = 4096;
constexpr int kJobs = 200;

void run_sql(const fs::path& file, const std::string& sql, bool stays_in_log = false) {
  sqlite3* database = nullptr;
  ASSERT_EQ(::sqlite3_open(file.c_str(), &database), SQLITE_OK);
  ::sqlite3_db_config(database, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, stays_in_log ? 1 : 0, nullptr);
  EXPECT_EQ(::sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << ::sqlite3_errmsg(database);
  ::sqlite3_close(database);
}

using Entries = std::map<std::uint64_t, std::string>;

Entries entries_of(const Journal& journal) {
  Entries entries;
  for (const JournalEntry& entry : journal.since(0, 100'000)) entries[entry.seq] = entry.job + entry.kind + entry.body;
  return entries;
}

/// A journal of jobs, some with images, and what may become of it.
class JournalDamage : public FolderTest {
 protected:
  /// With its log, as a daemon leaves it that is killed: without `in_log` all has been brought into the file.
  void make(bool in_log) {
    const fs::path made = folder_ / "made.db";
    fs::remove(made);
    Journal journal(made);
    for (int i = 0; i < kJobs; ++i) {
      Journal::Append entry;
      entry.job = "job" + std::to_string(i);
      entry.kind = i % 2 == 0 ? "completed" : "queued";
      entry.time = std::chrono::system_clock::time_point(std::chrono::milliseconds(1234567890123 + i));
      entry.body = [i] { return '"' + std::string(400, static_cast<char>('a' + i % 26)) + '"'; };
      if (i % 10 == 0) entry.image = std::make_shared<const std::string>(10'000, static_cast<char>('A' + i % 26));
      std::promise<void> written;
      entry.is_awaited = in_log;  // Then each is a transaction of its own.
      if (in_log) entry.done = [&written](const auto&, std::uint64_t) { written.set_value(); };
      journal.append(std::move(entry));
      if (in_log) written.get_future().get();
    }
    if (!in_log) journal.close();
    entries_ = entries_of(journal);
    if (!in_log) run_sql(made, "PRAGMA wal_checkpoint(TRUNCATE)");
    write("journal.db", read(made));
    write("journal.db-wal", read(made.string() + "-wal"));
    if (!in_log) fs::remove(log_);
  }

  /// One of many small entries, whose numbers have no gaps.
  void make_of_small_entries(int count) {
    Journal journal(file_);
    for (int i = 0; i < count; ++i) journal.append({"a job", "planned", {}, [] { return std::string("{}"); }});
    journal.close();
    entries_ = entries_of(journal);
    ASSERT_EQ(entries_.size(), static_cast<std::size_t>(count));
    run_sql(file_, "PRAGMA wal_checkpoint(TRUNCATE)");
  }

  void overwrite(const fs::path& path, std::size_t at, const std::string& with) const {
    std::string bytes = read(path);
    ASSERT_LE(at + with.size(), bytes.size());
    bytes.replace(at, with.size(), with);
    std::ofstream(path, std::ios::binary) << bytes;
  }

  /// It isn't used, and it is said why and what to do; a new one has this many entries at least, all as they were.
  void expect_salvage(std::size_t least_entries, std::size_t least_images = 0, bool is_there = true) {
    const std::string before = read(file_), log_before = read(log_);
    try {
      Journal journal(file_, Journal::Missing::is_lost);
      ADD_FAILURE() << "a damaged journal is used";
    } catch (const DamagedJournal& damage) {
      EXPECT_NE(std::string(damage.what()).find(file_.string()), std::string::npos) << damage.what();
      EXPECT_NE(std::string(damage.what()).find("tesserad --scrub"), std::string::npos) << damage.what();
      EXPECT_NE(std::string(damage.what()).find("remove journal.db-wal"), std::string::npos) << damage.what();
    }
    EXPECT_TRUE(read(file_) == before) << "the file has been changed";
    EXPECT_TRUE(read(log_) == log_before) << "the log has been changed";
    const JournalCheck check = check_journal(file_, Journal::Missing::is_lost, aside_);
    EXPECT_FALSE(check.damage.empty());
    EXPECT_GE(check.entries, least_entries);
    EXPECT_GE(check.images, least_images);
    EXPECT_EQ(fs::exists(aside_), is_there);
    Journal journal(file_);
    const Entries now = entries_of(journal);
    EXPECT_EQ(now.size(), check.entries);
    for (const auto& [seq, entry] : now) {
      ASSERT_TRUE(entries_.contains(seq)) << seq;
      EXPECT_EQ(entry, entries_.at(seq));
    }
    EXPECT_EQ(journal.images().size(), check.images);
    for (const std::string& job : journal.images()) EXPECT_EQ(journal.image(job)->size(), 10'000U) << job;
    journal.append({"later", "queued", {}, nullptr});
    journal.close();
    EXPECT_EQ(entries_of(Journal(file_)).size(), now.size() + 1);
    EXPECT_TRUE(check_journal(file_, Journal::Missing::is_lost, aside_).damage.empty());
    for (const char* left : {"journal.db.damaged", "journal.db.salvaged", "journal.db.salvaged-wal"})
      EXPECT_FALSE(fs::exists(folder_ / left)) << left;
  }

  const fs::path file_ = folder_ / "journal.db", log_ = folder_ / "journal.db-wal", aside_ = folder_ / "set-aside";
  Entries entries_;
};

TEST_F(JournalDamage, OfNoneNothingIsChanged) {
  for (const bool in_log : {false, true}) {
    make(in_log);
    const JournalCheck check = check_journal(file_, Journal::Missing::is_lost, aside_);
    EXPECT_EQ(check.damage, "");
    EXPECT_EQ(check.entries, std::size_t{kJobs});
    EXPECT_EQ(check.images, std::size_t{kJobs} / 10);
    EXPECT_FALSE(fs::exists(aside_));
    EXPECT_EQ(entries_of(Journal(file_)), entries_);
  }
}

TEST_F(JournalDamage, OfAnyPage) {
  make(false);
  const std::string whole = read(file_);
  for (std::size_t page = 0; page < whole.size() / kPage; page += page < 4 ? 1 : 3) {
    SCOPED_TRACE(page);
    write("journal.db", whole);
    overwrite(file_, page * kPage, std::string(kPage, 'x'));
    // A leaf has some ten entries. Where the tree of entries has its root, all the ways to them begin.
    expect_salvage(page == 0 || page == 3 ? kJobs : page == 1 ? 0 : kJobs - 12);
    fs::remove_all(aside_);
  }
}

TEST_F(JournalDamage, OfTheHeaderAlone) {
  make(false);
  for (const std::string& garbage : {std::string(100, '\xA5'), std::string(100, '\0'), std::string(kPage, '\xFF')}) {
    const std::string whole = read(file_);
    overwrite(file_, 0, garbage);
    expect_salvage(kJobs, kJobs / 10);
    write("journal.db", whole);
    fs::remove_all(aside_);
  }
}

TEST_F(JournalDamage, OfAFileThatIsCutOff) {
  make(false);
  const std::string whole = read(file_);
  fs::resize_file(file_, whole.size() / kPage / 2 * kPage);
  expect_salvage(kJobs / 4);
  write("journal.db", whole.substr(0, 50));
  expect_salvage(0);
  write("journal.db", "");
  expect_salvage(0);
}

TEST_F(JournalDamage, OfTheLog) {
  make(true);
  ASSERT_GT(fs::file_size(log_), 500'000U);
  const std::string file = read(file_), log = read(log_);
  constexpr std::size_t kFrame = kPage + 24;
  struct Damage {
    std::size_t at;
    std::string with;
  };
  for (const auto& [at, with] :
       {Damage{32 + 7 * kFrame + 100, "y"}, Damage{32 + 7 * kFrame + 16, "y"}, Damage{32 + 7 * kFrame + 8, "yyyyyyyy"},
        Damage{0, "garbage"}, Damage{16, "z"}, Damage{32 + 100 * kFrame, std::string(2 * kFrame, 'z')},
        Damage{0, std::string(kPage, '\0')}}) {
    SCOPED_TRACE(at);
    write("journal.db", file);
    write("journal.db-wal", log);
    overwrite(log_, at, with);
    expect_salvage(kJobs - 24);
    EXPECT_TRUE(fs::exists(aside_));
    fs::remove_all(aside_);
  }
  write("journal.db-wal", log);
  write("journal.db", "");
  expect_salvage(kJobs, kJobs / 10);
}

TEST_F(JournalDamage, OfAPageInTheLogOfWhichThereIsAnOlderOne) {
  make(true);
  const std::string log = read(log_);
  constexpr std::size_t kFrame = kPage + 24;
  std::size_t last = 0;  // Of the page where the tree of entries has its root.
  for (std::size_t at = 32; at + kFrame <= log.size(); at += kFrame)
    if (log.substr(at, 4) == std::string("\0\0\0\2", 4)) last = at;
  ASSERT_GT(last, log.size() / 2);
  overwrite(log_, last + 24, std::string(kPage, '\0'));
  expect_salvage(kJobs - 24);
}

TEST_F(JournalDamage, OfOneEntryInAllThatTheLogHasOfItsPage) {
  make(true);
  const std::string log = read(log_);
  constexpr std::size_t kFrame = kPage + 24;
  std::size_t leaf = 0;  // One that has entries alone, whose bodies end before their hashes.
  for (std::size_t at = 32; at < log.size() / 2; at += kFrame)
    if (log[at + 24] == '\x0D') leaf = at;
  ASSERT_GT(leaf, 0U);
  std::size_t times = 0;
  for (std::size_t at = 32; at + kFrame <= log.size(); at += kFrame) {
    if (log.substr(at, 4) != log.substr(leaf, 4)) continue;
    overwrite(log_, at + kFrame - 50, "!");
    ++times;
  }
  ASSERT_GT(times, 2U);
  expect_salvage(kJobs - 1);
}

TEST_F(JournalDamage, OfOneBitOfANumber) {
  make_of_small_entries(5000);
  const std::string number_1000 = "\x87\x68\x07", whole = read(file_);  // As it is written, and what follows.
  const std::size_t at = whole.find(number_1000);
  ASSERT_NE(at, whole.npos);
  ASSERT_EQ(whole.find(number_1000, at + 1), whole.npos);
  overwrite(file_, at, "\x87\xE8");  // Is 128007 now.
  expect_salvage(5000 - 120);
}

TEST_F(JournalDamage, OfAPageOnTheWayToManyEntries) {
  make_of_small_entries(60'000);
  const std::string whole = read(file_);
  const auto number = [&](std::size_t at, std::size_t bytes) {
    std::size_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | static_cast<unsigned char>(whole[at + i]);
    return value;
  };
  // The root's first cell: the page, and the last number to which that leads (sqlite.org/fileformat2.html, 1.6).
  const std::size_t cell = kPage + number(kPage + 12, 2), page = number(cell, 4) - 1;
  ASSERT_EQ(whole[page * kPage], '\x05') << "not on the way, but a leaf";
  std::size_t below = 0, digit = 0x80;
  for (std::size_t at = cell + 4; digit & 0x80; ++at) {
    digit = number(at, 1);
    below = below << 7 | (digit & 0x7F);
  }
  ASSERT_GT(below, 10'000U);
  ASSERT_LT(below, 50'000U);
  overwrite(file_, page * kPage, std::string(kPage, 'x'));
  expect_salvage(60'000 - below);
}

TEST_F(JournalDamage, IsNotWhatAKilledDaemonLeaves) {
  make(true);
  const std::string file = read(file_), log = read(log_);
  for (const std::size_t less : {1, 100, 4120, 5000}) {
    write("journal.db", file);
    write("journal.db-wal", log.substr(0, log.size() - less));
    EXPECT_GE(entries_of(Journal(file_)).size(), std::size_t{kJobs} - 1) << less;
  }
  write("journal.db", file);
  write("journal.db-wal", log);
  overwrite(log_, log.size() - 50, "torn");
  EXPECT_EQ(entries_of(Journal(file_)).size(), std::size_t{kJobs} - 1);
}

TEST_F(JournalDamage, OfOneEntry) {
  make(false);
  run_sql(file_, "UPDATE events SET body = replace(body, 'ccc', 'ccd') WHERE job = 'job2'");
  run_sql(file_, "UPDATE events SET hash = NULL WHERE job = 'job3'");
  expect_salvage(kJobs - 2, kJobs / 10);
  EXPECT_EQ(entries_of(Journal(file_)).size(), std::size_t{kJobs} - 2 + 1);
}

TEST_F(JournalDamage, OfOneEntryInTheLog) {
  make(true);
  run_sql(file_, "UPDATE events SET body = replace(body, 'ccc', 'ccd') WHERE job = 'job2'", true);
  ASSERT_GT(fs::file_size(log_), 500'000U);
  expect_salvage(kJobs - 1, kJobs / 10);
}

TEST_F(JournalDamage, OfImagesWhileItIsOpen) {
  make(false);
  const Journal journal(file_);
  overwrite(file_, 3 * kPage, std::string(kPage, 'x'));
  EXPECT_THROW(journal.images(), DamagedJournal);
  EXPECT_THROW(journal.image("job0"), DamagedJournal);
}

TEST_F(JournalDamage, AJournalThatIsGone) {
  EXPECT_THROW(Journal(file_, Journal::Missing::is_lost), DamagedJournal);
  EXPECT_FALSE(fs::exists(file_));
  make(true);
  fs::remove(file_);
  EXPECT_THROW(Journal(file_, Journal::Missing::is_new), DamagedJournal) << "its log is there";
  fs::remove(log_);
  expect_salvage(0, 0, false);
}

TEST_F(JournalDamage, AnInterruptedSalvageIsEnded) {
  make(false);
  fs::rename(file_, folder_ / "journal.db.salvaged");
  EXPECT_THROW(Journal(file_, Journal::Missing::is_new), DamagedJournal);
  const JournalCheck check = check_journal(file_, Journal::Missing::is_new, aside_);
  EXPECT_EQ(check.entries, std::size_t{kJobs});
  EXPECT_EQ(check.images, std::size_t{kJobs} / 10);
  EXPECT_EQ(entries_of(Journal(file_)), entries_);
}

TEST_F(JournalDamage, ANewerProgramsIsLeftAlone) {
  make(false);
  run_sql(file_, "PRAGMA user_version = 1000");
  const std::string before = read(file_);
  EXPECT_THROW(check_journal(file_, Journal::Missing::is_lost, aside_), std::runtime_error);
  EXPECT_EQ(read(file_), before);
  EXPECT_FALSE(fs::exists(aside_));
}

TEST_F(JournalDamage, EntriesOfAnOlderProgramAreHashed) {
  run_sql(file_,
          "CREATE TABLE events(seq INTEGER PRIMARY KEY, job TEXT NOT NULL, kind TEXT NOT NULL, time INTEGER NOT NULL, "
          "body TEXT NOT NULL) STRICT; CREATE INDEX events_by_job ON events(job);"
          "CREATE TABLE images(job TEXT PRIMARY KEY, image BLOB NOT NULL) STRICT, WITHOUT ROWID;"
          "INSERT INTO events VALUES(5, 'a', 'queued', 1000, '{}'), (7, 'b', 'queued', 2000, '{}');"
          "PRAGMA user_version = 2");
  EXPECT_EQ(entries_of(Journal(file_)), (Entries{{5, "aqueued{}"}, {7, "bqueued{}"}}));
  run_sql(file_, "UPDATE events SET time = 2001 WHERE seq = 7");
  EXPECT_THROW(entries_of(Journal(file_)), DamagedJournal);
}

}  // namespace
}  // namespace tessera::server

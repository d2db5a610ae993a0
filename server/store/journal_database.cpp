#include "server/store/journal_database.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include <sqlite3.h>

#include "proto/wire/sha256.h"
#include "server/store/received_file.h"
#include "server/store/write_ahead_log.h"

namespace tessera::server {
namespace fs = std::filesystem;
using Error = JournalDatabase::Error;

namespace {

/// How long another program may keep the database locked.
constexpr int kBusyMilliseconds = 2000;

/// What brings the database from version i to i + 1. Its version is that of the whole data folder: who changes what
/// lies there in a way that an older program would misread adds a row.
constexpr const char* kMigrations[] = {
    "CREATE TABLE events(seq INTEGER PRIMARY KEY, job TEXT NOT NULL, kind TEXT NOT NULL, time INTEGER NOT NULL, "
    "body TEXT NOT NULL) STRICT;"
    "CREATE INDEX events_by_job ON events(job);",
    "CREATE TABLE images(job TEXT PRIMARY KEY, image BLOB NOT NULL) STRICT, WITHOUT ROWID;",
    // Of all the others.
    "ALTER TABLE events ADD COLUMN hash INTEGER;",
};

/// SQLite knows pages that make no sense, but not those that were written otherwise: it has no checksums.
std::int64_t entry_hash(std::uint64_t seq, const std::string& job, const std::string& kind, std::int64_t milliseconds,
                        const std::string& body) {
  proto::Sha256 sha256;
  sha256.update(std::to_string(seq) + ' ' + job + ' ' + kind + ' ' + std::to_string(milliseconds) + ' ');
  sha256.update(body);
  const proto::ContentHash hash = sha256.finish();
  const char* const digits = hash.data() + hash.find(':') + 1;
  std::uint64_t value = 0;
  std::from_chars(digits, digits + 16, value, 16);
  return static_cast<std::int64_t>(value);
}

std::int64_t milliseconds_of(std::chrono::system_clock::time_point time) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch()).count();
}

std::string column(sqlite3_stmt* statement, int index) {
  const auto* bytes = static_cast<const char*>(::sqlite3_column_blob(statement, index));
  return bytes ? std::string(bytes, static_cast<std::size_t>(::sqlite3_column_bytes(statement, index))) : "";
}

/// To SQLite a quota, or a limit for files' sizes, is an I/O error like others.
bool is_full_by(int error) { return error == ENOSPC || error == EDQUOT || error == EFBIG; }

/// Gives back what a statement holds, whatever becomes of it.
struct Rewound {
  sqlite3_stmt* statement;
  ~Rewound() { ::sqlite3_reset(statement); }
};

}  // namespace

JournalDatabase::JournalDatabase(const fs::path& file, Open how) : file_(file) {
  const int flags = how == Open::read    ? SQLITE_OPEN_READONLY
                    : how == Open::write ? SQLITE_OPEN_READWRITE
                                         : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  if (::sqlite3_open_v2(file.c_str(), &database_, flags | SQLITE_OPEN_NOMUTEX, nullptr) != SQLITE_OK) {
    const std::string why = database_ ? ::sqlite3_errmsg(database_) : "out of memory";
    ::sqlite3_close_v2(database_);
    throw Error(file.string() + ": " + why, Error::Kind::other);
  }
  ::sqlite3_busy_timeout(database_, kBusyMilliseconds);
  // The file may have been in anybody's hands: nothing in its schema may run code, or be written to directly.
  ::sqlite3_db_config(database_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  ::sqlite3_db_config(database_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  ::stat(file.c_str(), &opened_);
}

JournalDatabase::~JournalDatabase() {
  for (sqlite3_stmt* statement : {insert_, remove_, select_, insert_image_, remove_image_, select_image_, list_images_})
    ::sqlite3_finalize(statement);
  ::sqlite3_close_v2(database_);
}

void JournalDatabase::run(const char* sql) { check(::sqlite3_exec(database_, sql, nullptr, nullptr, nullptr)); }

void JournalDatabase::try_to_run(const char* sql) noexcept {
  ::sqlite3_exec(database_, sql, nullptr, nullptr, nullptr);
}

std::string JournalDatabase::text(const char* sql) {
  sqlite3_stmt* statement = nullptr;
  prepare(statement, sql);
  const bool has_row = ::sqlite3_step(statement) == SQLITE_ROW;
  const std::string text = has_row ? column(statement, 0) : "";
  const int result = ::sqlite3_finalize(statement);
  if (!has_row) check(result);
  return text;
}

std::int64_t JournalDatabase::number(const char* sql) {
  const std::string digits = text(sql);
  std::int64_t number = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return number;
}

void JournalDatabase::insert(std::uint64_t seq, const Journal::Append& entry, const std::string& body) {
  prepare(insert_, "INSERT OR REPLACE INTO events(seq, job, kind, time, body, hash) VALUES(?, ?, ?, ?, ?, ?)");
  const std::int64_t time = milliseconds_of(entry.time);
  bind(insert_, 1, static_cast<std::int64_t>(seq));
  bind(insert_, 2, entry.job);
  bind(insert_, 3, entry.kind);
  bind(insert_, 4, time);
  bind(insert_, 5, body);
  bind(insert_, 6, entry_hash(seq, entry.job, entry.kind, time, body));
  run_once(insert_);
}

void JournalDatabase::remove(const std::string& job) {
  prepare(remove_, "DELETE FROM events WHERE job = ?");
  bind(remove_, 1, job);
  run_once(remove_);
}

void JournalDatabase::insert_image(const std::string& job, const std::string& image) {
  prepare(insert_image_, "INSERT OR REPLACE INTO images VALUES(?, ?)");
  bind(insert_image_, 1, job);
  check(::sqlite3_bind_blob(insert_image_, 2, image.data(), static_cast<int>(image.size()), SQLITE_STATIC));
  run_once(insert_image_);
}

void JournalDatabase::remove_image(const std::string& job) {
  prepare(remove_image_, "DELETE FROM images WHERE job = ?");
  bind(remove_image_, 1, job);
  run_once(remove_image_);
}

void JournalDatabase::keep_log(bool keeps) {
  ::sqlite3_db_config(database_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, keeps ? 1 : 0, nullptr);
}

void JournalDatabase::write_back() {
  if (number("PRAGMA wal_checkpoint(TRUNCATE)") != 0)
    throw Error(file_.string() + ": its log can't be brought into it, as another program reads it", Error::Kind::other);
}

void JournalDatabase::walk(std::uint64_t seq, std::size_t limit,
                           const std::function<void(JournalEntry&&, bool is_whole)>& use) {
  prepare(select_, "SELECT seq, job, kind, time, body, hash FROM events WHERE seq >= ? ORDER BY seq LIMIT ?");
  const Rewound at_the_end{select_};
  // With a greater one than the last below a page, the way doesn't lead to that.
  bind(select_, 1, static_cast<std::int64_t>(std::min<std::uint64_t>(seq, kLastEntry)) + 1);
  bind(select_, 2, static_cast<std::int64_t>(limit));
  while (step(select_)) {
    const std::int64_t time = ::sqlite3_column_int64(select_, 3);
    JournalEntry entry{static_cast<std::uint64_t>(::sqlite3_column_int64(select_, 0)), column(select_, 1),
                       column(select_, 2), journal_time(time), column(select_, 4)};
    const bool is_whole = !expects_hashes_ || (::sqlite3_column_type(select_, 5) != SQLITE_NULL &&
                                               ::sqlite3_column_int64(select_, 5) ==
                                                   entry_hash(entry.seq, entry.job, entry.kind, time, entry.body));
    use(std::move(entry), is_whole);
  }
}

std::vector<JournalEntry> JournalDatabase::since(std::uint64_t seq, std::size_t limit) {
  std::vector<JournalEntry> entries;
  walk(seq, limit, [&](JournalEntry&& entry, bool is_whole) {
    if (!is_whole)
      throw Error(file_.string() + ": entry " + std::to_string(entry.seq) + " isn't what was written",
                  Error::Kind::damage);
    entries.push_back(std::move(entry));
  });
  return entries;
}

std::optional<std::string> JournalDatabase::image(const std::string& job) {
  prepare(select_image_, "SELECT image FROM images WHERE job = ?");
  const Rewound at_the_end{select_image_};
  bind(select_image_, 1, job);
  if (!step(select_image_)) return std::nullopt;
  return column(select_image_, 0);
}

std::vector<std::string> JournalDatabase::images() {
  prepare(list_images_, "SELECT job FROM images ORDER BY job");
  const Rewound at_the_end{list_images_};
  std::vector<std::string> jobs;
  while (step(list_images_)) jobs.push_back(column(list_images_, 0));
  return jobs;
}

void JournalDatabase::add_hashes() {
  expect_hashes(false);
  constexpr std::size_t kAtOnce = 1000;
  std::uint64_t last = 0;
  for (auto entries = since(last, kAtOnce); !entries.empty(); entries = since(last, kAtOnce)) {
    for (const JournalEntry& entry : entries) {
      last = entry.seq;
      insert(last, {entry.job, entry.kind, entry.time, nullptr}, entry.body);
    }
  }
  expect_hashes(true);
}

void JournalDatabase::check_file() const {
  struct stat now {};
  if (::stat(file_.c_str(), &now) != 0 || now.st_ino != opened_.st_ino || now.st_dev != opened_.st_dev)
    throw Error(file_.string() + " isn't there any more", Error::Kind::other);
}

void JournalDatabase::prepare(sqlite3_stmt*& statement, const char* sql) {
  if (!statement) check(::sqlite3_prepare_v2(database_, sql, -1, &statement, nullptr));
}

void JournalDatabase::bind(sqlite3_stmt* statement, int place, const std::string& text) {
  check(::sqlite3_bind_text(statement, place, text.data(), static_cast<int>(text.size()), SQLITE_STATIC));
}

void JournalDatabase::bind(sqlite3_stmt* statement, int place, std::int64_t number) {
  check(::sqlite3_bind_int64(statement, place, number));
}

bool JournalDatabase::step(sqlite3_stmt* statement) {
  const int result = ::sqlite3_step(statement);
  if (result != SQLITE_ROW && result != SQLITE_DONE) check(result);
  return result == SQLITE_ROW;
}

void JournalDatabase::run_once(sqlite3_stmt* statement) {
  const Rewound at_the_end{statement};
  step(statement);
}

/// What the system said last of the write-ahead log.
int JournalDatabase::errno_of_log() const {
  sqlite3_file* log = nullptr;
  int error = 0;
  ::sqlite3_file_control(database_, "main", SQLITE_FCNTL_JOURNAL_POINTER, &log);
  if (log && log->pMethods) log->pMethods->xFileControl(log, SQLITE_FCNTL_LAST_ERRNO, &error);
  return error;
}

void JournalDatabase::check(int result) const {
  if (result == SQLITE_OK) return;
  const int code = result & 0xFF;
  auto kind = Error::Kind::other;
  if (code == SQLITE_FULL || (code == SQLITE_IOERR && is_full_by(errno_of_log()))) kind = Error::Kind::full;
  // What the statements name is there in every journal.
  if (code == SQLITE_CORRUPT || code == SQLITE_NOTADB || code == SQLITE_ERROR) kind = Error::Kind::damage;
  throw Error(file_.string() + ": " + ::sqlite3_errmsg(database_), kind);
}

namespace {

fs::path log_of(const fs::path& file) { return file.string() + "-wal"; }

std::uint64_t bytes_of(const fs::path& file) {
  std::error_code missing;
  const std::uint64_t bytes = fs::file_size(file, missing);
  return missing ? 0 : bytes;
}

/// Why SQLite would make an empty database of what is there, or pass over a part of it, without a word.
std::string hidden_damage(const fs::path& file) {
  const std::uint64_t log_bytes = bytes_of(log_of(file));
  if (bytes_of(file) == 0 && log_bytes > 0) return "it is empty or gone, but its log is there";
  if (bytes_of(file) == 0) return "it is empty";
  if (log_bytes == 0) return "";
  std::ifstream stream(log_of(file), std::ios::binary);
  const std::string log{std::istreambuf_iterator<char>(stream), {}};
  return read_write_ahead_log(log).damage;
}

/// Throws where something of it isn't what was written.
void check_all(JournalDatabase& database, const fs::path& file) {
  if (const std::string said = database.text("PRAGMA quick_check(1)"); said != "ok") throw DamagedJournal(file, said);
  const std::int64_t version = database.number("PRAGMA user_version");
  if (version <= 0 || version > std::ssize(kMigrations)) return;
  if (database.number("SELECT coalesce(max(seq), 0) FROM events") > kLastEntry)
    throw DamagedJournal(file, "an entry has a number that no entry can have");
  if (version <= kWithoutHashes) return;
  constexpr std::size_t kAtOnce = 1000;
  std::uint64_t last = 0;
  for (auto entries = database.since(last, kAtOnce); !entries.empty(); entries = database.since(last, kAtOnce))
    last = entries.back().seq;
}

/// Brings it up to date.
void migrate(JournalDatabase& database, const fs::path& file) {
  const std::int64_t version = database.number("PRAGMA user_version"), newest = std::ssize(kMigrations);
  if (version > newest)
    throw Error(file.string() + " is of version " + std::to_string(version) + ", and this program knows " +
                    std::to_string(newest) + "; run the newer program that made it, or give another folder",
                Error::Kind::other);
  if (version < 0) throw Error(file.string() + ": it has no version", Error::Kind::damage);
  for (std::int64_t from = version; from < newest; ++from) {
    database.run((std::string("BEGIN IMMEDIATE;") + kMigrations[from]).c_str());
    if (from == kWithoutHashes) database.add_hashes();
    database.run(("PRAGMA user_version = " + std::to_string(from + 1) + ";COMMIT;").c_str());
  }
}

/// Under another name first: so one that is empty has never been whole.
void make_journal(const fs::path& file) {
  const fs::path made = file.string() + ".new";
  for (const char* left_over : {"", "-journal"}) fs::remove(made.string() + left_over);
  {
    JournalDatabase database(made, JournalDatabase::Open::make);
    database.run(("PRAGMA page_size = " + std::to_string(kJournalPage)).c_str());
    migrate(database, made);
  }
  fs::rename(made, file);
  sync_folder(fs::absolute(file).parent_path());
}

}  // namespace

std::unique_ptr<JournalDatabase> open_journal(const fs::path& file, Journal::Missing missing) try {
  if (!fs::exists(file) && bytes_of(log_of(file)) == 0) {
    if (missing == Journal::Missing::is_lost || fs::exists(file.string() + kSalvagedJournal))
      throw DamagedJournal(file, "it is gone, though what jobs have left is there");
    make_journal(file);
  }
  if (const std::string damage = hidden_damage(file); !damage.empty()) throw DamagedJournal(file, damage);
  auto database = std::make_unique<JournalDatabase>(file, JournalDatabase::Open::write);
  database->keep_log(true);
  check_all(*database, file);
  // With FULL each transaction is synced before it counts. NORMAL would sync at checkpoints alone, so that a power cut
  // takes back what clients have been told; EXTRA differs from FULL only where there is no write-ahead log.
  // The log grows to some 32 MiB before it is brought into the file, which takes several syncs.
  database->run("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA wal_autocheckpoint = 8192;");
  migrate(*database, file);
  database->keep_log(false);
  // That jobs are gone is kept in mind of so many.
  database->run(
      "DELETE FROM events WHERE kind IN ('removed', 'expired') AND seq < (SELECT coalesce(min(seq), 0) FROM (SELECT "
      "seq FROM events WHERE kind IN ('removed', 'expired') ORDER BY seq DESC LIMIT 10000))");
  return database;
} catch (const Error& error) {
  if (error.kind == Error::Kind::damage) throw DamagedJournal(file, error.what());
  throw;
}

}  // namespace tessera::server

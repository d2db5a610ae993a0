#include "server/store/journal.h"

#include <algorithm>
#include <cerrno>
#include <exception>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <spdlog/spdlog.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include "server/store/received_file.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

namespace {

/// How long what nobody waits for may lie, to be written with others.
constexpr std::chrono::milliseconds kAtLeisure{50};
constexpr std::chrono::milliseconds kTryToWriteAgain{200};
/// How long another program may keep the database locked.
constexpr int kBusyMilliseconds = 2000;

/// What brings the database from version i to i + 1. Its version is that of the whole data folder: who changes what
/// lies there in a way that an older program would misread adds a row.
constexpr const char* kMigrations[] = {
    "CREATE TABLE events(seq INTEGER PRIMARY KEY, job TEXT NOT NULL, kind TEXT NOT NULL, time INTEGER NOT NULL, "
    "body TEXT NOT NULL) STRICT;"
    "CREATE INDEX events_by_job ON events(job);",
    "CREATE TABLE images(job TEXT PRIMARY KEY, image BLOB NOT NULL) STRICT, WITHOUT ROWID;",
};

}  // namespace

/// A connection to the database. What goes wrong is thrown.
class JournalDatabase {
 public:
  struct Error : std::runtime_error {
    Error(const std::string& what, bool full) : std::runtime_error(what), is_full(full) {}
    bool is_full;
  };

  JournalDatabase(const std::filesystem::path& file, int flags) : file_(file) {
    if (::sqlite3_open_v2(file.c_str(), &database_, flags | SQLITE_OPEN_NOMUTEX, nullptr) == SQLITE_OK) {
      ::sqlite3_busy_timeout(database_, kBusyMilliseconds);
      ::stat(file.c_str(), &opened_);
      return;
    }
    const std::string why = database_ ? ::sqlite3_errmsg(database_) : "out of memory";
    ::sqlite3_close_v2(database_);
    throw Error(file.string() + ": " + why, false);
  }
  ~JournalDatabase() {
    for (sqlite3_stmt* statement :
         {insert_, remove_, select_, insert_image_, remove_image_, select_image_, list_images_})
      ::sqlite3_finalize(statement);
    ::sqlite3_close_v2(database_);
  }
  JournalDatabase(const JournalDatabase&) = delete;

  void run(const char* sql) { check(::sqlite3_exec(database_, sql, nullptr, nullptr, nullptr)); }

  /// For statements that can't fail any more than they already have.
  void try_to_run(const char* sql) noexcept { ::sqlite3_exec(database_, sql, nullptr, nullptr, nullptr); }

  /// The first column of the first row.
  std::string text(const char* sql) {
    sqlite3_stmt* statement = nullptr;
    prepare(statement, sql);
    const bool has_row = ::sqlite3_step(statement) == SQLITE_ROW;
    const std::string text = has_row ? column(statement, 0) : "";
    const int result = ::sqlite3_finalize(statement);
    if (!has_row) check(result);
    return text;
  }
  std::uint64_t number(const char* sql) { return std::stoull(text(sql)); }

  void remove(const std::string& job) {
    prepare(remove_, "DELETE FROM events WHERE job = ?");
    bind(remove_, 1, job);
    step(remove_);
  }

  void insert(std::uint64_t seq, const Journal::Append& entry, const std::string& body) {
    prepare(insert_, "INSERT OR REPLACE INTO events VALUES(?, ?, ?, ?, ?)");
    const auto time = std::chrono::duration_cast<std::chrono::milliseconds>(entry.time.time_since_epoch());
    check(::sqlite3_bind_int64(insert_, 1, static_cast<sqlite3_int64>(seq)));
    bind(insert_, 2, entry.job);
    bind(insert_, 3, entry.kind);
    check(::sqlite3_bind_int64(insert_, 4, time.count()));
    bind(insert_, 5, body);
    step(insert_);
  }

  void insert_image(const std::string& job, const std::string& image) {
    prepare(insert_image_, "INSERT OR REPLACE INTO images VALUES(?, ?)");
    bind(insert_image_, 1, job);
    check(::sqlite3_bind_blob(insert_image_, 2, image.data(), static_cast<int>(image.size()), SQLITE_STATIC));
    step(insert_image_);
  }

  void remove_image(const std::string& job) {
    prepare(remove_image_, "DELETE FROM images WHERE job = ?");
    bind(remove_image_, 1, job);
    step(remove_image_);
  }

  std::optional<std::string> image(const std::string& job) {
    prepare(select_image_, "SELECT image FROM images WHERE job = ?");
    bind(select_image_, 1, job);
    std::optional<std::string> image;
    const int result = ::sqlite3_step(select_image_);
    if (result == SQLITE_ROW) {
      const auto* bytes = static_cast<const char*>(::sqlite3_column_blob(select_image_, 0));
      image.emplace(bytes ? bytes : "", static_cast<std::size_t>(::sqlite3_column_bytes(select_image_, 0)));
    }
    ::sqlite3_reset(select_image_);
    if (result != SQLITE_ROW && result != SQLITE_DONE) check(result);
    return image;
  }

  std::vector<std::string> images() {
    prepare(list_images_, "SELECT job FROM images ORDER BY job");
    std::vector<std::string> jobs;
    int result = SQLITE_ROW;
    while ((result = ::sqlite3_step(list_images_)) == SQLITE_ROW) jobs.push_back(column(list_images_, 0));
    ::sqlite3_reset(list_images_);
    if (result != SQLITE_DONE) check(result);
    return jobs;
  }

  std::vector<JournalEntry> since(std::uint64_t seq, std::size_t limit) {
    prepare(select_, "SELECT seq, job, kind, time, body FROM events WHERE seq > ? ORDER BY seq LIMIT ?");
    check(::sqlite3_bind_int64(select_, 1, static_cast<sqlite3_int64>(seq)));
    check(::sqlite3_bind_int64(select_, 2, static_cast<sqlite3_int64>(limit)));
    std::vector<JournalEntry> entries;
    int result = SQLITE_ROW;
    while ((result = ::sqlite3_step(select_)) == SQLITE_ROW) {
      const std::chrono::milliseconds time(::sqlite3_column_int64(select_, 3));
      entries.push_back({static_cast<std::uint64_t>(::sqlite3_column_int64(select_, 0)), column(select_, 1),
                         column(select_, 2), std::chrono::system_clock::time_point(time), column(select_, 4)});
    }
    ::sqlite3_reset(select_);
    if (result != SQLITE_DONE) check(result);
    return entries;
  }

  /// What is written into a file that has been deleted is lost, and SQLite doesn't notice.
  void check_file() const {
    struct stat now {};
    if (::stat(file_.c_str(), &now) != 0 || now.st_ino != opened_.st_ino || now.st_dev != opened_.st_dev)
      throw Error(file_.string() + " isn't there any more", false);
  }

 private:
  void prepare(sqlite3_stmt*& statement, const char* sql) {
    if (!statement) check(::sqlite3_prepare_v2(database_, sql, -1, &statement, nullptr));
  }
  void bind(sqlite3_stmt* statement, int place, const std::string& text) {
    check(::sqlite3_bind_text(statement, place, text.data(), static_cast<int>(text.size()), SQLITE_STATIC));
  }
  void step(sqlite3_stmt* statement) {
    const int result = ::sqlite3_step(statement);
    ::sqlite3_reset(statement);
    if (result != SQLITE_DONE) check(result);
  }
  static std::string column(sqlite3_stmt* statement, int index) {
    const auto* text = reinterpret_cast<const char*>(::sqlite3_column_text(statement, index));
    return text ? std::string(text, static_cast<std::size_t>(::sqlite3_column_bytes(statement, index))) : "";
  }

  /// To SQLite a quota, or a limit for files' sizes, is an I/O error like others.
  static bool is_full_by(int error) { return error == ENOSPC || error == EDQUOT || error == EFBIG; }

  /// What the system said last of the write-ahead log.
  int errno_of_log() const {
    sqlite3_file* log = nullptr;
    int error = 0;
    ::sqlite3_file_control(database_, "main", SQLITE_FCNTL_JOURNAL_POINTER, &log);
    if (log && log->pMethods) log->pMethods->xFileControl(log, SQLITE_FCNTL_LAST_ERRNO, &error);
    return error;
  }

  void check(int result) const {
    if (result == SQLITE_OK) return;
    const bool is_full =
        (result & 0xFF) == SQLITE_FULL || ((result & 0xFF) == SQLITE_IOERR && is_full_by(errno_of_log()));
    throw Error(file_.string() + ": " + ::sqlite3_errmsg(database_), is_full);
  }

  const std::filesystem::path file_;
  struct stat opened_ {};
  sqlite3* database_ = nullptr;
  sqlite3_stmt *insert_ = nullptr, *remove_ = nullptr, *select_ = nullptr;
  sqlite3_stmt *insert_image_ = nullptr, *remove_image_ = nullptr, *select_image_ = nullptr, *list_images_ = nullptr;
};

namespace {

/// The connection that writes, to a database of this program's version.
std::unique_ptr<JournalDatabase> open_journal(const std::filesystem::path& file) {
  auto database = std::make_unique<JournalDatabase>(file, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  // With FULL each transaction is synced before it counts. NORMAL would sync at checkpoints alone, so that a power cut
  // takes back what clients have been told; EXTRA differs from FULL only where there is no write-ahead log.
  // The log grows to some 32 MiB before it is brought into the file, which takes several syncs.
  database->run("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA wal_autocheckpoint = 8192;");
  if (const std::string said = database->text("PRAGMA quick_check(1)"); said != "ok")
    throw std::runtime_error(file.string() + " is damaged: " + said);
  const std::uint64_t version = database->number("PRAGMA user_version"), newest = std::size(kMigrations);
  if (version > newest)
    throw std::runtime_error(file.string() + " is of version " + std::to_string(version) + ", and this program knows " +
                             std::to_string(newest) + "; run the newer program that made it, or give another folder");
  for (std::uint64_t from = version; from < newest; ++from) {
    const std::string step = std::string("BEGIN IMMEDIATE;") + kMigrations[from] +
                             "PRAGMA user_version = " + std::to_string(from + 1) + ";COMMIT;";
    database->run(step.c_str());
  }
  // That jobs are gone is kept in mind of so many.
  database->run(
      "DELETE FROM events WHERE kind IN ('removed', 'expired') AND seq < (SELECT coalesce(min(seq), 0) FROM (SELECT "
      "seq "
      "FROM events WHERE kind IN ('removed', 'expired') ORDER BY seq DESC LIMIT 10000))");
  sync_folder(file.parent_path());
  return database;
}

Problem problem_of(const JournalDatabase::Error& error) {
  if (error.is_full)
    return {ProblemCode::insufficient_storage, "There is no room on the disk to write down what is asked for.", {}};
  return {ProblemCode::storage_unavailable, "The server can't write down what is asked for; its log says why.", {}};
}

}  // namespace

Journal::Journal(const std::filesystem::path& file)
    : writing_(open_journal(file)),
      reading_(std::make_unique<JournalDatabase>(file, SQLITE_OPEN_READONLY)),
      last_seq_(writing_->number("SELECT coalesce(max(seq), 0) FROM events")),
      writer_([this] { write_on(); }) {}

Journal::~Journal() { close(); }

void Journal::close() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_one();
  if (writer_.joinable()) writer_.join();
}

std::uint64_t Journal::append(Append entry) {
  const auto due = Clock::now() + (entry.is_awaited ? Clock::duration::zero() : kAtLeisure);
  std::uint64_t seq = 0;
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back({last_seq_ + 1, std::move(entry)});
    seq = ++last_seq_;
    due_ = std::min(due_.value_or(due), due);
  }
  changed_.notify_one();
  return seq;
}

void Journal::remove_image(const std::string& job) {
  Append entry{job, "image_gone", std::chrono::system_clock::now(), nullptr};
  entry.removes_image = true;
  append(std::move(entry));
}

std::vector<JournalEntry> Journal::since(std::uint64_t seq, std::size_t limit) const {
  const std::lock_guard lock(reading_mutex_);
  return reading_->since(seq, limit);
}

std::optional<std::string> Journal::image(const std::string& job) const {
  const std::lock_guard lock(reading_mutex_);
  return reading_->image(job);
}

std::vector<std::string> Journal::images() const {
  const std::lock_guard lock(reading_mutex_);
  return reading_->images();
}

std::optional<Problem> Journal::trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

void Journal::write_on() {
  std::unique_lock lock(mutex_);
  for (bool is_last = false; !is_last;) {
    while (!closing_ && !(due_ && *due_ <= Clock::now())) {
      if (due_)
        changed_.wait_until(lock, *due_);
      else
        changed_.wait(lock);
    }
    is_last = closing_;
    std::vector<Waiting> batch = std::move(waiting_);
    waiting_.clear();
    due_.reset();
    if (batch.empty()) continue;
    lock.unlock();
    const auto problem = write(batch);
    lock.lock();
    trouble_ = problem;
    lock.unlock();
    for (const Waiting& waiting : batch)
      if (waiting.entry.done) waiting.entry.done(problem, waiting.seq);
    if (problem)
      std::erase_if(batch, [](const Waiting& waiting) { return waiting.entry.on_failure == OnFailure::refuse; });
    else
      batch.clear();
    lock.lock();
    if (batch.empty()) continue;
    waiting_.insert(waiting_.begin(), std::make_move_iterator(batch.begin()), std::make_move_iterator(batch.end()));
    const auto again = Clock::now() + kTryToWriteAgain;
    due_ = std::min(due_.value_or(again), again);
  }
}

std::optional<Problem> Journal::write(const std::vector<Waiting>& batch) try {
  try {
    writing_->check_file();
    writing_->run("BEGIN IMMEDIATE");
    for (const auto& [seq, entry] : batch) {
      if (entry.removes_others) writing_->remove(entry.job);
      if (entry.removes_others || entry.removes_image) writing_->remove_image(entry.job);
      if (entry.image) writing_->insert_image(entry.job, *entry.image);
      writing_->insert(seq, entry, entry.body ? entry.body() : "{}");
    }
    writing_->run("COMMIT");
  } catch (...) {
    writing_->try_to_run("ROLLBACK");
    throw;
  }
  return std::nullopt;
} catch (const JournalDatabase::Error& error) {
  spdlog::error("the journal: {}", error.what());
  return problem_of(error);
} catch (const std::exception& error) {
  spdlog::error("the journal: {}", error.what());
  return Problem{
      ProblemCode::storage_unavailable, "The server can't write down what is asked for; its log says why.", {}};
}

}  // namespace tessera::server

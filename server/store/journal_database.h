#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <sys/stat.h>

#include "server/store/journal.h"

struct sqlite3;
struct sqlite3_stmt;

namespace tessera::server {

/// A connection to the journal's database (SQLite). What goes wrong is thrown as an Error. For one thread at a time.
class JournalDatabase {
 public:
  struct Error : std::runtime_error {
    enum class Kind { full, damage, other } kind;
    Error(const std::string& what, Kind its_kind) : std::runtime_error(what), kind(its_kind) {}
  };

  enum class Open { read, write, make };
  JournalDatabase(const std::filesystem::path& file, Open how);
  ~JournalDatabase();
  JournalDatabase(const JournalDatabase&) = delete;

  void run(const char* sql);
  /// For statements that can't fail any more than they already have.
  void try_to_run(const char* sql) noexcept;
  /// The first column of the first row.
  std::string text(const char* sql);
  std::int64_t number(const char* sql);

  void insert(std::uint64_t seq, const Journal::Append& entry, const std::string& body);
  void remove(const std::string& job);
  void insert_image(const std::string& job, const std::string& image);
  void remove_image(const std::string& job);

  /// Whether the log stays as it is when this is closed, and the file with it.
  void keep_log(bool keeps);
  /// Brings all of the log into the file. Throws where that isn't there for good afterwards.
  void write_back();

  /// Shows at most `limit` rows with a greater `seq`, in order, and says of each whether it is what was written.
  void walk(std::uint64_t seq, std::size_t limit, const std::function<void(JournalEntry&&, bool is_whole)>& use);
  /// At most `limit` entries with a greater `seq`, in order. One that isn't what was written is damage.
  std::vector<JournalEntry> since(std::uint64_t seq, std::size_t limit);
  /// Whether an entry without a hash is damage.
  void expect_hashes(bool expects) { expects_hashes_ = expects; }
  /// To entries that have none.
  void add_hashes();
  std::optional<std::string> image(const std::string& job);
  std::vector<std::string> images();

  /// Throws when the file isn't there any more: what is written into one that has been deleted is lost, and SQLite
  /// doesn't notice.
  void check_file() const;

 private:
  void prepare(sqlite3_stmt*& statement, const char* sql);
  void bind(sqlite3_stmt* statement, int place, const std::string& text);
  void bind(sqlite3_stmt* statement, int place, std::int64_t number);
  /// Whether there is one more row.
  bool step(sqlite3_stmt* statement);
  void run_once(sqlite3_stmt* statement);
  int errno_of_log() const;
  void check(int result) const;

  bool expects_hashes_ = true;
  const std::filesystem::path file_;
  struct stat opened_ {};
  sqlite3* database_ = nullptr;
  sqlite3_stmt *insert_ = nullptr, *remove_ = nullptr, *select_ = nullptr;
  sqlite3_stmt *insert_image_ = nullptr, *remove_image_ = nullptr, *select_image_ = nullptr, *list_images_ = nullptr;
};

/// The last version whose entries had no hashes.
inline constexpr std::int64_t kWithoutHashes = 2;

/// How a new journal is called until it takes the place of a damaged one, which has been set aside by then.
inline constexpr const char* kSalvagedJournal = ".salvaged";

/// The connection that writes, to a database of this program's version; where there is none, a new one, if it may be
/// made. Throws DamagedJournal, and JournalDatabase::Error where it can't be used otherwise.
std::unique_ptr<JournalDatabase> open_journal(const std::filesystem::path& file, Journal::Missing missing);

}  // namespace tessera::server

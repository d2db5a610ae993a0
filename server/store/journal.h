#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "proto/wire/problem.h"

namespace tessera::server {

class JournalDatabase;

/// Something that happened to a job, as it lies in the journal.
struct JournalEntry {
  std::uint64_t seq = 0;  ///< Grows; some numbers are left out.
  std::string job;
  std::string kind;
  std::chrono::system_clock::time_point time;  ///< To the millisecond.
  std::string body;                            ///< JSON.
};

/// Milliseconds since 1970 as the clock tells moments; those that it can't tell are the last, or the first, that it
/// can.
std::chrono::system_clock::time_point journal_time(std::int64_t milliseconds);

/// No entry has a greater number.
inline constexpr std::int64_t kLastEntry = std::int64_t{1} << 62;

/// A journal that isn't what was written: what is wrong with it, and what to do.
struct DamagedJournal : std::runtime_error {
  DamagedJournal(const std::filesystem::path& file, const std::string& what_is_wrong);
  const std::string why;
};

/// What happened to jobs, in the order in which it did, on disk: an embedded SQLite database. Entries are only
/// appended; those of a job that has been removed go, but for the one that says so. Small images lie beside them, so
/// that a job's end and its image are one write to the disk. One thread writes, and takes all that has queued up
/// meanwhile into one transaction, so that a disk that syncs slowly still takes many jobs a second. Safe to call from
/// any number of threads; `append` may be called with a mutex held, as it waits for nothing.
class Journal {
 public:
  /// What it is when there is no file: the first time, or that it has been lost.
  enum class Missing { is_new, is_lost };
  /// Opens it, or makes a new one, or brings one of an older version up to date. Throws DamagedJournal, and
  /// std::runtime_error when it can't be used otherwise: it is a newer program's, say.
  explicit Journal(const std::filesystem::path& file, Missing missing = Missing::is_new);
  /// Closes.
  ~Journal();
  Journal(const Journal&) = delete;

  enum class OnFailure { refuse, retry };

  /// An entry to be appended.
  struct Append {
    std::string job;
    std::string kind;
    std::chrono::system_clock::time_point time;
    std::function<std::string()> body;  ///< Makes it, on the thread that writes.
    OnFailure on_failure = OnFailure::retry;
    bool is_awaited = false;      ///< Otherwise it may lie for a moment, to be written with others.
    bool removes_others = false;  ///< All other entries of the job go with it, and its image.
    bool removes_image = false;
    /// The job's image, where it is to be kept beside the entries.
    std::shared_ptr<const std::string> image = nullptr;
    /// Called after each try, on the thread that writes, in the order of `seq`: with nothing once it is there for good,
    /// a power cut notwithstanding, and with what is in the way otherwise. It may append.
    std::function<void(const std::optional<proto::Problem>&, std::uint64_t seq)> done = nullptr;
  };
  /// Its `seq`, which is greater than those of all before.
  std::uint64_t append(Append entry);

  /// Has a job's image go, some time.
  void remove_image(const std::string& job);

  /// At most `limit` entries with a greater `seq`, in order. Throws DamagedJournal when one isn't what was written, and
  /// std::runtime_error when they can't be read otherwise.
  std::vector<JournalEntry> since(std::uint64_t seq, std::size_t limit) const;

  /// The image that was appended for a job; nothing where there is none. Throws as `since` does.
  std::optional<std::string> image(const std::string& job) const;
  /// The jobs that have one, in order. Throws as `since` does.
  std::vector<std::string> images() const;

  /// Why the last try to write failed; nothing when it didn't.
  std::optional<proto::Problem> trouble() const;

  /// Tries once more to write what waits, and writes no more. Nothing is called any more once it has returned.
  void close();

 private:
  using Clock = std::chrono::steady_clock;

  struct Waiting {
    std::uint64_t seq;
    Append entry;
  };

  void write_on();
  std::optional<proto::Problem> write(const std::vector<Waiting>& batch);
  void log_once(const std::string& error);
  /// What `from` makes of the connection that reads.
  template <typename Read>
  auto read(const Read& from) const;

  const std::unique_ptr<JournalDatabase> writing_;  ///< The writer's alone, once that has begun.
  mutable std::mutex reading_mutex_;
  const std::unique_ptr<JournalDatabase> reading_;  ///< Guarded by `reading_mutex_`.
  const std::filesystem::path file_;
  std::string last_error_;  ///< Of writing; empty when that went well. The writer's alone.

  mutable std::mutex mutex_;  ///< Guards what follows; nothing is called while it is held.
  std::condition_variable changed_;
  std::vector<Waiting> waiting_;
  std::optional<Clock::time_point> due_;  ///< When they have to be written, if there are any.
  std::uint64_t last_seq_;
  std::optional<proto::Problem> trouble_;
  bool closing_ = false;
  std::jthread writer_;
};

}  // namespace tessera::server

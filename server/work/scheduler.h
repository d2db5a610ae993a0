#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

namespace tessera::server {

/// Shares threads among batches of work, in turn, a unit at a time: a batch of few units ends soon beside a batch of
/// millions. A unit may be done in steps, and each is a turn. Safe to call from any number of threads, its own
/// included.
///
/// Steps had better be short. While one takes longer than `long_step` and others wait, one more thread is at work, so
/// that jobs render while all threads build. There are twice as many at most, and fewer where the system gives none.
class Scheduler {
 public:
  using Clock = std::chrono::steady_clock;

  /// Does unit `index` of its batch, or a step of it. Whether it is done; if not it is called again with this index,
  /// before further units of the batch are begun. Doesn't throw.
  using Unit = std::function<bool(std::size_t index)>;

  /// Throws std::system_error where the system doesn't give that many threads.
  explicit Scheduler(unsigned threads, Clock::duration long_step = std::chrono::milliseconds(100));
  ~Scheduler();

  /// Begins units 0..count−1 in that order, as threads become free. Once `stop` is requested, or the scheduler shuts
  /// down, those are dropped that haven't begun or are between two steps. `unit` is destroyed when none is left.
  void submit(std::size_t count, Unit unit, std::stop_token stop = {});

  /// Begins no more steps, and waits for those in progress. Whether they all ended in time.
  bool shut_down(Clock::duration patience);

  unsigned threads() const { return usual_; }

  /// What threads have done since the start, in seconds times threads: idle while there was no work at all, starved
  /// while others worked and there was nothing more to begin.
  struct Usage {
    unsigned threads;
    std::size_t busy;  ///< Steps in progress; more than `threads` while some take long.
    double busy_seconds, starved_seconds, idle_seconds;
  };
  Usage usage();

 private:
  struct Batch {
    bool waits() const { return next < count || !paused.empty(); }

    std::size_t next;   ///< The unit to begin next.
    std::size_t count;  ///< Of all units.
    Unit unit;
    std::stop_token stop;
    std::vector<std::size_t> paused = {};  ///< Units between two steps. Has room for all.
    std::size_t at_work = 0;               ///< Its steps in progress.
  };
  using Batches = std::list<std::shared_ptr<Batch>>;

  /// A step in progress.
  struct Step {
    std::shared_ptr<Batch> batch;
    std::size_t index = 0;
    Clock::time_point since;
    bool is_long = false;
  };

  /// The body of a thread that does steps.
  void work();
  /// Waits for the next step in turn. False when there will be none.
  bool take(Step& step);
  void end(Step& step, bool is_done);
  /// The next batch that has a step to be done. Stopped ones are moved to `dropped` on the way.
  Batches::iterator next_turn(Batches& dropped);
  /// The body of the thread that looks for long steps.
  void watch();
  /// Counts what threads did up to `now`; to be called before `at_work_` changes.
  void account(Clock::time_point now);
  bool is_anyone_waiting() const;
  std::size_t most_at_work() const { return usual_ + std::min<std::size_t>(long_steps_, usual_); }
  void add_thread_if_needed();
  void close();

  const unsigned usual_;
  const Clock::duration long_step_;
  std::mutex mutex_;                  ///< Guards what follows; no unit is called or destroyed while it is held.
  std::condition_variable may_work_;  ///< There is a step to be done, or one more thread may be at work.
  std::condition_variable may_wait_;  ///< A step may have to wait.
  std::condition_variable idle_;      ///< None is in progress.
  Batches turns_;                     ///< Batches that aren't done; the front is next.
  std::vector<Step*> at_work_;        ///< Has room for all.
  std::size_t long_steps_ = 0;        ///< Of those at work.
  bool closed_ = false;
  Clock::time_point accounted_ = Clock::now();  ///< Up to when these are right, of all threads together:
  Clock::duration busy_time_{}, starved_time_{}, idle_time_{};
  std::vector<std::jthread> threads_;  ///< Has room for all.
  std::jthread watch_;                 ///< It alone adds threads later.
};

}  // namespace tessera::server

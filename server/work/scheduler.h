#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "server/work/turn_order.h"

namespace tessera::server {

/// Shares threads among batches of work, a unit at a time, in `TurnOrder`'s turns. A unit may be done in steps, and
/// each is a turn. Safe to call from any number of threads, its own included.
///
/// Steps had better be short. While one takes longer than `long_step` and others wait, one more thread is at work, so
/// that jobs render while all threads build. There are twice as many at most, and fewer where the system gives none.
class Scheduler {
 public:
  using Clock = std::chrono::steady_clock;

  /// What a step may ask about its turn, as often as it likes.
  class Turn {
   public:
    /// Whether others ought to go on: it has taken as long as it is meant to, or somebody waits who goes before.
    bool is_over() const { return is_called_off_.load(std::memory_order_relaxed) || Clock::now() >= until_; }
    /// Whether a thread has nothing to do: what is submitted now will be begun at once.
    bool has_idle_threads() const { return has_idle_threads_->load(std::memory_order_relaxed); }

   private:
    friend Scheduler;
    std::atomic<bool> is_called_off_ = false;
    Clock::time_point until_;
    const std::atomic<bool>* has_idle_threads_ = nullptr;
  };

  /// Does unit `index` of its batch, or a step of it. Whether it is done; if not it is called again with this index,
  /// before further units of the batch are begun. Doesn't throw.
  using Unit = std::function<bool(std::size_t index, const Turn& turn)>;

  /// Throws std::system_error where the system doesn't give that many threads.
  explicit Scheduler(unsigned threads, Clock::duration long_step = std::chrono::milliseconds(100),
                     Clock::duration turn = TurnOrder::kTurn);
  ~Scheduler();

 private:
  struct Account;

 public:
  /// A job that work is done for; as long as anybody has this, it is known how much time it has had.
  using Job = std::shared_ptr<Account>;
  Job open(const Claim& claim);

  /// Begins units 0..count−1 in that order, as threads become free and it is the job's turn. Once `stop` is requested,
  /// or the scheduler shuts down, those are dropped that haven't begun or are between two steps. `unit` is destroyed
  /// when none is left.
  void submit(const Job& job, std::size_t count, Unit unit, std::stop_token stop = {});
  /// For nobody in particular.
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

  /// What has been spent on a job, in seconds times threads, those of steps in progress included; and how much threads
  /// have been starved since it was opened.
  struct Spent {
    double busy_seconds, starved_seconds;
  };
  Spent spent(const Job& job);

 private:
  /// Tells the scheduler that a batch is to be dropped, without waiting for anything.
  struct Dropper {
    void operator()() const noexcept;
    Scheduler& scheduler;
  };

  struct Batch {
    bool waits() const { return next < count || !paused.empty(); }

    Batch(Job whose, std::size_t units, Unit what, std::stop_token until)
        : job(std::move(whose)), count(units), unit(std::move(what)), stop(std::move(until)) {}

    const Job job;
    std::size_t next = 0;     ///< The unit to begin next.
    const std::size_t count;  ///< Of all units.
    Unit unit;
    const std::stop_token stop;
    std::vector<std::size_t> paused;  ///< Units between two steps. Has room for all.
    std::size_t at_work = 0;          ///< Its steps in progress.
    std::optional<std::stop_callback<Dropper>> dropper;
  };
  using Batches = std::list<std::shared_ptr<Batch>>;

  struct Account : TurnOrder::Account {
    Account(TurnOrder& order, const Claim& claim, Clock::duration starved)
        : TurnOrder::Account(order, claim), starved_before(starved) {}
    const Clock::duration starved_before;
    Batches batches;  ///< That aren't done, the first first.
  };

  /// A step in progress.
  struct Step {
    std::shared_ptr<Batch> batch;
    std::size_t index = 0;
    Clock::time_point since;
    bool is_long = false;
    Turn turn = {};
  };

  /// The body of a thread that does steps.
  void work();
  /// Waits for the next step in turn. False when there will be none.
  bool take(Step& step);
  void begin(Step& step, Account& account);
  void end(Step& step, bool is_done);
  /// Has steps end soon, of jobs that are to wait for this one, as far as it needs threads for so many units.
  void make_way_for(const Account& account, std::size_t units);
  /// Moves away batches that have been stopped, as far as they are waiting: of all jobs, unless that was done just now,
  /// or of one.
  void drop_stopped(Batches& dropped);
  void drop_stopped(Account& account, Batches& dropped);
  /// To be called whenever an account's batches have changed.
  void update(Account& account);
  void tell_idle_threads();
  /// The body of the thread that looks for long steps.
  void watch();
  /// Counts what threads did up to `now`; to be called before `at_work_` changes.
  void account_time(Clock::time_point now);
  std::size_t most_at_work() const { return usual_ + std::min<std::size_t>(long_steps_, usual_); }
  void add_thread_if_needed();
  void close();

  const unsigned usual_;
  const Clock::duration long_step_, turn_;
  std::mutex mutex_;                  ///< Guards what follows; no unit is called or destroyed while it is held.
  std::condition_variable may_work_;  ///< There is a step to be done, or one more thread may be at work.
  std::condition_variable may_wait_;  ///< A step may have to wait.
  std::condition_variable idle_;      ///< None is in progress.
  TurnOrder order_;                   ///< Of jobs that have steps to be done.
  std::vector<Step*> at_work_;        ///< Has room for all.
  std::size_t long_steps_ = 0;        ///< Of those at work.
  bool closed_ = false;
  Clock::time_point next_look_;                 ///< For batches that have been stopped.
  std::atomic<bool> some_stopped_ = false;      ///< Batches, since this was looked at last. Needs no lock,
  std::atomic<bool> has_idle_threads_ = false;  ///< nor does this.
  Clock::time_point accounted_ = Clock::now();  ///< Up to when these are right, of all threads together:
  Clock::duration busy_time_{}, starved_time_{}, idle_time_{};
  Job nobody_;                         ///< Opened when all of that is there.
  std::vector<std::jthread> threads_;  ///< Has room for all.
  std::jthread watch_;                 ///< It alone adds threads later.
};

}  // namespace tessera::server

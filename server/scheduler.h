#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <stop_token>

#include <boost/asio/thread_pool.hpp>

namespace tessera::server {

/// Shares a pool of threads among batches of work, in turn, a unit at a time: a batch of few units ends soon
/// beside a batch of millions. Safe to call from any number of threads, those of the pool included.
class Scheduler {
 public:
  /// Does unit `index` of its batch; doesn't throw.
  using Unit = std::function<void(std::size_t index)>;

  explicit Scheduler(unsigned threads);
  ~Scheduler();

  /// Runs `unit` for 0..count−1 in that order, as threads become free. Units that haven't begun are dropped once
  /// `stop` is requested, or the scheduler shuts down. Throws std::bad_alloc, and runs none then.
  void submit(std::size_t count, Unit unit, std::stop_token stop = {});

  /// Begins no more units, and waits for those in progress. Whether they all ended in time.
  bool shut_down(std::chrono::steady_clock::duration patience);

  unsigned threads() const { return threads_; }

 private:
  struct Batch {
    std::size_t next;
    std::size_t count;
    Unit unit;
    std::stop_token stop;
  };
  using Turns = std::list<std::shared_ptr<Batch>>;
  struct Taken {
    std::shared_ptr<Batch> batch;
    std::size_t index;
  };

  /// The body of a pool thread's task: works until nothing is left.
  void work();
  /// The next unit in turn, or none, and then this worker counts as gone. Stopped batches end up in `dropped`.
  Taken take(Turns& dropped);

  const unsigned threads_;
  std::mutex mutex_;  ///< Guards what follows; nothing is called while it is held.
  std::condition_variable idle_;
  Turns turns_;           ///< Batches with units left; the front is next. Taking turns takes no memory.
  unsigned workers_ = 0;  ///< Tasks of the pool that are at work.
  bool closed_ = false;
  boost::asio::thread_pool pool_;
};

}  // namespace tessera::server

#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "core/accel/build_stop.h"

namespace tessera {

/// Calls `work(i)` for every i < count, from up to `threads` threads, or as many as the system gives. What one throws
/// first is thrown again, once all have come back; of the rest some may be left out then.
template <typename Work>
void for_each_index(std::size_t count, unsigned threads, Work&& work) {
  std::atomic<std::size_t> next = 0;
  std::atomic_flag has_failed;
  std::exception_ptr failure;
  const auto run = [&] {
    try {
      for (std::size_t i; (i = next++) < count;) {
        BuildStop::check();
        work(i);
      }
    } catch (...) {
      next = count;
      if (!has_failed.test_and_set()) failure = std::current_exception();
    }
  };
  const auto help = [&, stop = BuildStop::current()] {
    const BuildStop same(stop);
    run();
  };
  {
    std::vector<std::jthread> helpers;
    try {
      while (helpers.size() + 1 < threads && helpers.size() + 1 < count) helpers.emplace_back(help);
    } catch (const std::system_error&) {  // then with those that there are
    }
    run();
  }
  if (failure) std::rethrow_exception(failure);
}

/// Tasks that lead to further tasks, done last in, first out, until none is left.
template <typename Task>
class TaskStack {
 public:
  void push(Task task) {
    {
      const std::lock_guard lock(mutex_);
      tasks_.push_back(std::move(task));
      ++unfinished_;
    }
    changed_.notify_one();
  }

  /// Does tasks from `threads` threads until all are done. `work(task)` may push; what it throws ends all.
  template <typename Work>
  void run(unsigned threads, Work&& work) {
    for_each_index(threads, threads, [&](std::size_t) {
      std::unique_lock lock(mutex_);
      while (true) {
        changed_.wait(lock, [&] { return !tasks_.empty() || unfinished_ == 0 || has_failed_; });
        if (tasks_.empty() || has_failed_) return;
        const Task task = std::move(tasks_.back());
        tasks_.pop_back();
        lock.unlock();
        try {
          work(task);
        } catch (...) {
          lock.lock();
          has_failed_ = true;
          changed_.notify_all();
          throw;
        }
        lock.lock();
        if (--unfinished_ == 0) changed_.notify_all();
      }
    });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Task> tasks_;
  std::size_t unfinished_ = 0;
  bool has_failed_ = false;
};

}  // namespace tessera

#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace tessera {

/// Calls `work(i)` for every i < count, from up to `threads` threads.
template <typename Work>
void for_each_index(std::size_t count, unsigned threads, Work&& work) {
  std::atomic<std::size_t> next = 0;
  const auto run = [&] {
    for (std::size_t i; (i = next++) < count;) work(i);
  };
  std::vector<std::jthread> helpers;
  while (helpers.size() + 1 < threads && helpers.size() + 1 < count) helpers.emplace_back(run);
  run();
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

  /// Does tasks from `threads` threads until all are done. `work(task)` may push.
  template <typename Work>
  void run(unsigned threads, Work&& work) {
    for_each_index(threads, threads, [&](std::size_t) {
      std::unique_lock lock(mutex_);
      while (true) {
        changed_.wait(lock, [&] { return !tasks_.empty() || unfinished_ == 0; });
        if (tasks_.empty()) return;
        const Task task = std::move(tasks_.back());
        tasks_.pop_back();
        lock.unlock();
        work(task);
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
};

}  // namespace tessera

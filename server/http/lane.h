#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace tessera::server {

/// Threads that do pieces of work in the order in which they come. Handing one over allocates nothing.
class Lane {
 public:
  struct Work {
    virtual void run() noexcept = 0;
    Work* next = nullptr;

   protected:
    ~Work() = default;
  };

  /// Throws std::system_error when there can't be so many threads.
  explicit Lane(unsigned threads);
  /// Waits for the work at hand; what hasn't begun never does.
  ~Lane();

  /// Waits as the destructor does. Once.
  void close();

  /// `work` lives until it has run. For any thread.
  void push(Work& work) noexcept;

 private:
  void work_on() noexcept;

  std::mutex mutex_;  ///< Guards what follows; nothing is called while it is held.
  std::condition_variable changed_;
  Work *first_ = nullptr, *last_ = nullptr;
  bool closed_ = false;
  std::vector<std::jthread> threads_;
};

/// Thrown by work in the quick lane that turns out to be too much for it: it is done again, from its beginning, in the
/// slow one. No std::exception, so that nobody takes it for a failure.
struct TooHeavy {};

/// While one lives, work of its thread may read so many bytes of files; for threads without one there is no limit.
class FileBudget {
 public:
  explicit FileBudget(std::uint64_t bytes);
  ~FileBudget();
  FileBudget(const FileBudget&) = delete;
  FileBudget& operator=(const FileBudget&) = delete;

  /// Whether this thread's work has one: then it may not wait for work of others either.
  static bool is_limited();
  /// To be called before a file is read. Throws TooHeavy when less is left.
  static void spend(std::uint64_t bytes);
};

}  // namespace tessera::server

#pragma once

#include <functional>

#include <sched.h>

namespace tessera::bench {

/// Runs `half(0)` and `half(1)`: one after the other on the calling thread, or at once on two threads that start
/// together. Returns seconds of processor time; of two threads, those of the one that took more.
double seconds_of_halves(int threads, const std::function<void(int)>& half);

/// Keeps this thread, and those that it starts, to the first so many of the processors that it may run on (or to all
/// of them, where they are fewer), for its scope.
class OnProcessors {
 public:
  explicit OnProcessors(int count);
  ~OnProcessors() { sched_setaffinity(0, sizeof before_, &before_); }
  OnProcessors(const OnProcessors&) = delete;
  OnProcessors& operator=(const OnProcessors&) = delete;

 private:
  cpu_set_t before_;
};

}  // namespace tessera::bench

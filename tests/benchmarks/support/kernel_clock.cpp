#include "tests/benchmarks/support/kernel_clock.h"

#include <algorithm>
#include <array>
#include <barrier>
#include <ctime>
#include <thread>

namespace tessera::bench {
namespace {

double thread_seconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

double seconds_of_halves(int threads, const std::function<void(int)>& half) {
  if (threads == 1) {
    const double start = thread_seconds();
    half(0);
    half(1);
    return thread_seconds() - start;
  }
  std::array<double, 2> seconds{};
  std::barrier ready(2);
  const auto run = [&](std::size_t which) {
    ready.arrive_and_wait();
    const double start = thread_seconds();
    half(static_cast<int>(which));
    seconds[which] = thread_seconds() - start;
  };
  { const std::jthread first(run, 0), second(run, 1); }
  return std::ranges::max(seconds);
}

OnProcessors::OnProcessors(int count) {
  sched_getaffinity(0, sizeof before_, &before_);
  cpu_set_t some;
  CPU_ZERO(&some);
  for (std::size_t cpu = 0; cpu < CPU_SETSIZE && CPU_COUNT(&some) < count; ++cpu)
    if (CPU_ISSET(cpu, &before_)) CPU_SET(cpu, &some);
  sched_setaffinity(0, sizeof some, &some);
}

}  // namespace tessera::bench

#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <queue>
#include <span>
#include <vector>

namespace tessera {

/// When the last of these pieces of work ends if each, in their order, goes to the first of `cores` that is free
/// (Graham, "Bounds on Multiprocessing Timing Anomalies", 1969), in the unit of the durations. 0 without work.
/// Precondition: at least one core, no negative duration.
inline double list_schedule(std::span<const double> durations, std::size_t cores) {
  std::priority_queue<double, std::vector<double>, std::greater<>> free_at(std::greater<>(),
                                                                           std::vector<double>(cores, 0.0));
  double end = 0;
  for (const double duration : durations) {
    const double done = free_at.top() + duration;
    free_at.pop();
    free_at.push(done);
    end = std::max(end, done);
  }
  return end;
}

}  // namespace tessera

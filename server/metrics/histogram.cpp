#include "server/metrics/histogram.h"

#include <algorithm>

namespace tessera::server {

void Histogram::add(std::chrono::nanoseconds time) noexcept {
  const std::chrono::nanoseconds counted = std::max(time, std::chrono::nanoseconds(0));
  const double seconds = std::chrono::duration<double>(counted).count();
  const auto at = static_cast<std::size_t>(std::ranges::lower_bound(bounds_, seconds) - bounds_.begin());
  counts_[at == bounds_.size() ? kMostBounds : at].fetch_add(1, std::memory_order_relaxed);
  nanoseconds_.fetch_add(static_cast<std::uint64_t>(counted.count()), std::memory_order_relaxed);
}

Histogram::Reading Histogram::read() const noexcept {
  Reading reading{bounds_, {}, 0, static_cast<double>(nanoseconds_.load(std::memory_order_relaxed)) * 1e-9};
  for (std::size_t i = 0; i < bounds_.size(); ++i)
    reading.below[i] = reading.count += counts_[i].load(std::memory_order_relaxed);
  reading.count += counts_[kMostBounds].load(std::memory_order_relaxed);
  return reading;
}

}  // namespace tessera::server

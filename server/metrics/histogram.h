#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tessera::server {

/// How long things took, counted by upper bounds. Counting is two atomic additions: for any thread, and for the way of
/// a tile, where prometheus-cpp's own would take a lock.
class Histogram {
 public:
  static constexpr std::size_t kMostBounds = 16;

  /// `bounds` are seconds that grow, at most `kMostBounds`; they outlive this.
  explicit Histogram(std::span<const double> bounds) : bounds_(bounds) {}

  /// What takes as long as a bound counts as below it. Times below 0 count as 0.
  void add(std::chrono::nanoseconds time) noexcept;

  /// As one moment shows it, or nearly: what comes while it is read may be counted in `sum` and not in `below`.
  struct Reading {
    std::span<const double> bounds;
    std::array<std::uint64_t, kMostBounds> below;  ///< As many of each bound, those below lesser ones included.
    std::uint64_t count;                           ///< All.
    double sum;                                    ///< Seconds.
  };
  Reading read() const noexcept;

 private:
  const std::span<const double> bounds_;
  std::array<std::atomic<std::uint64_t>, kMostBounds + 1> counts_{};  ///< By bound; those above all bounds come last.
  std::atomic<std::uint64_t> nanoseconds_{0};
};

}  // namespace tessera::server

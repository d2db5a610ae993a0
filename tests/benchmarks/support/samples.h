#pragma once

#include <chrono>
#include <ctime>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace tessera::bench {

/// Repeated measurements of one thing.
class Samples {
 public:
  void add(double value) { values_.push_back(value); }
  bool empty() const { return values_.empty(); }
  double last() const { return values_.back(); }

  double median() const { return quantile(0.5); }
  /// Half the distance between the quartiles, as a share of the median.
  double spread() const;
  /// Linear between the sorted values; `q` in [0, 1]. Precondition: not empty.
  double quantile(double q) const;

  /// {"median", "q1", "q3", "min", "max", "n"}
  nlohmann::json to_json() const;

 private:
  std::vector<double> values_;
};

/// Seconds since it was made.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Seconds that processors spent on this process since it was made: other work on the machine counts little.
class CpuStopwatch {
 public:
  double seconds() const { return static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC; }

 private:
  std::clock_t start_ = std::clock();
};

}  // namespace tessera::bench

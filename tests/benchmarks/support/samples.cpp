#include "tests/benchmarks/support/samples.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

namespace tessera::bench {

double Samples::quantile(double q) const {
  std::vector<double> sorted = values_;
  std::ranges::sort(sorted);
  const double at = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const auto above = std::min(below + 1, sorted.size() - 1);
  return std::lerp(sorted[below], sorted[above], at - static_cast<double>(below));
}

double Samples::spread() const { return (quantile(0.75) - quantile(0.25)) / (2 * std::abs(median())); }

nlohmann::json Samples::to_json() const {
  if (empty()) return nullptr;
  return {{"median", median()}, {"q1", quantile(0.25)}, {"q3", quantile(0.75)},
          {"min", quantile(0)}, {"max", quantile(1)},   {"n", values_.size()}};
}

}  // namespace tessera::bench

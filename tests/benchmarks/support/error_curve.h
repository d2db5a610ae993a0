#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/benchmarks/support/light_renderers.h"

namespace tessera::bench {

/// A long render, in two independent halves, that errors are measured against.
class LongReference {
 public:
  LongReference(const FloatImage& half, const FloatImage& other_half);

  /// relMSE of an image whose noise has nothing to do with the halves'. The reference's own, which the halves'
  /// difference tells, doesn't count: so a curve has no floor where the reference ends.
  double error(const FloatImage& image) const { return relative_mse(image, mean_) - own_error_; }

  const FloatImage& image() const { return mean_; }

 private:
  FloatImage mean_;
  double own_error_ = 0;
};

struct ErrorPoint {
  std::uint32_t samples = 0;
  double seconds = 0;
  double relative_mse = 0;

  double efficiency() const { return 1 / (relative_mse * seconds); }
};

/// How a renderer's error falls with its samples, which grow by factors of 4.
struct ErrorCurve {
  std::string renderer;
  std::vector<ErrorPoint> points;

  const ErrorPoint* at(std::uint32_t samples) const;
  /// Of the line through log RMSE over log samples, fitted to the points of at least `kFirstFitted` samples; NaN with
  /// fewer than three points, or where an error vanishes. Seconds grow with samples, but for the noise of the clock.
  double slope() const;
  nlohmann::json to_json() const;
};

/// Fewer samples take hardly longer than starting.
inline constexpr std::uint32_t kFirstFitted = 16;

/// The mean, over the logarithms, of how much more efficient `ours` is at equal samples, `kFirstFitted` at least.
double efficiency_ratio(const ErrorCurve& ours, const ErrorCurve& theirs);

double geometric_mean(const std::vector<double>& values);

}  // namespace tessera::bench

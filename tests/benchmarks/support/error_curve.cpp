#include "tests/benchmarks/support/error_curve.h"

#include <cmath>

namespace tessera::bench {

LongReference::LongReference(const FloatImage& half, const FloatImage& other_half) : mean_(half) {
  for (std::size_t i = 0; i < mean_.pixels.size(); ++i)
    mean_.pixels[i] = (half.pixels[i] + other_half.pixels[i]) * 0.5F;
  // Half the difference varies as much as the mean does; so does either half's distance from the mean.
  own_error_ = relative_mse(half, mean_);
}

const ErrorPoint* ErrorCurve::at(std::uint32_t samples) const {
  for (const ErrorPoint& point : points)
    if (point.samples == samples) return &point;
  return nullptr;
}

double ErrorCurve::slope() const {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const ErrorPoint& point : points) {
    if (point.samples < kFirstFitted) continue;
    const double samples = std::log(point.samples), rmse = 0.5 * std::log(point.relative_mse);
    n += 1, x += samples, y += rmse, xx += samples * samples, xy += samples * rmse;
  }
  return n < 3 ? std::nan("") : (n * xy - x * y) / (n * xx - x * x);
}

nlohmann::json ErrorCurve::to_json() const {
  nlohmann::json list = nlohmann::json::array();
  for (const ErrorPoint& point : points)
    list.push_back({{"samples", point.samples}, {"seconds", point.seconds}, {"relative_mse", point.relative_mse}});
  return {{"renderer", renderer}, {"slope", slope()}, {"points", std::move(list)}};
}

double efficiency_ratio(const ErrorCurve& ours, const ErrorCurve& theirs) {
  std::vector<double> ratios;
  for (const ErrorPoint& point : ours.points)
    if (const ErrorPoint* peer = theirs.at(point.samples); peer && point.samples >= kFirstFitted)
      ratios.push_back(point.efficiency() / peer->efficiency());
  return geometric_mean(ratios);
}

double geometric_mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += std::log(value);
  return std::exp(sum / static_cast<double>(values.size()));
}

}  // namespace tessera::bench

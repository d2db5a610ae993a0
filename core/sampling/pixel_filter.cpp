#include "core/sampling/pixel_filter.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/math/float_environment.h"
#include "core/math/portable.h"

namespace tessera {
namespace {

constexpr std::size_t kPieces = 256;

/// Standard deviations 1/4.
double gaussian(double x) { return portable_exp2(-8 * x * x * (1 / std::numbers::ln2)); }

double blackman_harris(double x) {
  const double angle = std::numbers::pi * x;
  return 0.35875 + 0.48829 * portable_cos(angle) + 0.14128 * portable_cos(2 * angle) +
         0.01168 * portable_cos(3 * angle);
}

double default_width(FilterKind kind) { return kind == FilterKind::box ? 1 : 1.5; }

}  // namespace

PixelFilter::PixelFilter(FilterKind kind, float width) {
  const StrictFloats strict;
  const double chosen = width == 0 ? default_width(kind) : width;
  reach_ = kind == FilterKind::box ? chosen / 2 : chosen;
  if (kind == FilterKind::box) return;
  density_.reserve(kPieces + 1);
  integral_ = {0};
  for (std::size_t i = 0; i <= kPieces; ++i) {
    const double x = static_cast<double>(i) / kPieces;
    density_.push_back(kind == FilterKind::gaussian ? gaussian(x) : blackman_harris(x));
    if (i > 0) integral_.push_back(integral_.back() + (density_[i - 1] + density_[i]) / 2);
  }
}

PixelOffset PixelFilter::sample(PixelOffset u) const {
  if (density_.empty()) return {u.x + (u.x - 0.5) * (2 * reach_ - 1), u.y + (u.y - 0.5) * (2 * reach_ - 1)};
  return {0.5 + reach_ * invert(u.x), 0.5 + reach_ * invert(u.y)};
}

/// In [-1, 1].
double PixelFilter::invert(double u) const {
  const double side = 2 * u - 1, target = std::abs(side) * integral_.back();
  const auto next = std::upper_bound(integral_.begin() + 1, integral_.end() - 1, target);
  const auto piece = static_cast<std::size_t>(next - integral_.begin()) - 1;
  // Where in the piece the trapezoid under its straight density has the area that is left.
  const double area = target - integral_[piece], first = density_[piece], slope = density_[piece + 1] - first;
  const double part = 2 * area / (first + std::sqrt(std::max(0.0, first * first + 2 * slope * area)));
  return std::copysign((static_cast<double>(piece) + std::min(part, 1.0)) / kPieces, side);
}

}  // namespace tessera

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>
#include <vector>

namespace tessera {

// Tests of hypotheses: each gives a p-value, the probability of a result at least as far off if the hypothesis holds. A
// test that repeats them m times and wants to fail wrongly with probability α at most compares with sidak(α, m). NaN
// among the data gives p = 0: nothing passes by being broken. Formulas: Press et al. 2007, Numerical Recipes, ch.
// 6, 14.

/// Mean and variance of what was added, one pass (Welford 1962).
class Moments {
 public:
  void add(double value) {
    ++count_;
    const double difference = value - mean_;
    mean_ += difference / count_;
    squares_ += difference * (value - mean_);
  }

  double count() const { return count_; }
  double mean() const { return mean_; }
  /// Of one value, the sample's (divided by count - 1); needs two values.
  double variance() const { return squares_ / (count_ - 1); }
  double variance_of_mean() const { return variance() / count_; }
  double standard_error() const { return std::sqrt(variance_of_mean()); }

 private:
  double count_ = 0, mean_ = 0, squares_ = 0;
};

/// The level at which each of `tests` independent tests must reject for all together to reject wrongly with
/// probability `alpha` (Šidák 1967).
inline double sidak(double alpha, double tests) { return -std::expm1(std::log1p(-alpha) / tests); }

/// P(|Z| ≥ |z|) of a standard normal Z.
inline double normal_p(double z) { return std::isnan(z) ? 0 : std::erfc(std::abs(z) / std::numbers::sqrt2); }

/// P(X ≥ statistic) of a χ² with that many degrees of freedom: the upper incomplete gamma function Q(k/2, x/2).
inline double chi_square_p(double statistic, double degrees) {
  const double a = degrees / 2, x = statistic / 2;
  if (!(x < std::numeric_limits<double>::infinity())) return 0;
  if (x <= 0) return 1;
  const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1) {  // the series of 1 - Q
    double term = 1 / a, sum = term;
    for (double n = a + 1; term > sum * 1e-16; ++n) sum += term *= x / n;
    return 1 - front * sum;
  }
  double b = x + 1 - a, c = 1e300, d = 1 / b, fraction = d;  // Lentz's continued fraction
  for (int i = 1; i < 100'000; ++i) {
    const double factor = -i * (i - a);
    b += 2;
    d = 1 / (b + factor * d);
    c = b + factor / c;
    fraction *= c * d;
    if (std::abs(c * d - 1) < 1e-15) break;
  }
  return front * fraction;
}

/// P(|T| ≥ |t|) of Student's t with that many degrees of freedom, which needn't be whole: the incomplete beta function
/// I_x(degrees / 2, 1/2) at x = degrees / (degrees + t²).
inline double student_p(double t, double degrees) {
  if (std::isnan(t) || std::isnan(degrees)) return 0;
  const double square = t * t;
  if (square == 0) return 1;
  if (std::isinf(square)) return 0;
  // Lentz's continued fraction, on the side where it converges fast.
  const auto beta = [](double a, double b, double x, double rest) {
    double c = 1, d = 1 / (1 - (a + b) * x / (a + 1)), fraction = d;
    for (int m = 1; m < 100'000; ++m) {
      const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
      d = 1 / (1 + even * d);
      c = 1 + even / c;
      fraction *= c * d;
      const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
      d = 1 / (1 + odd * d);
      c = 1 + odd / c;
      fraction *= c * d;
      if (std::abs(c * d - 1) < 1e-15) break;
    }
    return std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log(rest)) *
           fraction / a;
  };
  const double a = degrees / 2, b = 0.5, x = degrees / (degrees + square), rest = square / (degrees + square);
  return x < (a + 1) / (a + b + 2) ? beta(a, b, x, rest) : 1 - beta(b, a, rest, x);
}

/// Student's t-test: that the values' true mean is `expected`, two-sided. Without variance only the very number passes.
inline double t_test(const Moments& values, double expected) {
  const double difference = values.mean() - expected;
  if (difference == 0) return 1;
  return student_p(difference / values.standard_error(), values.count() - 1);
}

/// Welch's t-test: that both have one true mean, two-sided; their variances may differ.
inline double welch_test(const Moments& a, const Moments& b) {
  const double difference = a.mean() - b.mean();
  if (difference == 0) return 1;
  const double va = a.variance_of_mean(), vb = b.variance_of_mean(), sum = va + vb;
  if (sum == 0) return 0;
  const double degrees = sum * sum / (va * va / (a.count() - 1) + vb * vb / (b.count() - 1));
  return student_p(difference / std::sqrt(sum), degrees);
}

struct ChiSquare {
  double statistic = 0, degrees = 0, p = 0;
};

/// Pearson's test of goodness of fit: that cell i's true frequency is expected[i]. Cells with a small expectation are
/// pooled, smallest first, until each pool expects `least`; what is seen where nothing can be gives p = 0. `expected`
/// sums to what is observed, or to less where some of the draws fail: then give failures a cell of their own.
inline ChiSquare chi_square_test(std::span<const double> observed, std::span<const double> expected, double least = 5) {
  std::vector<std::size_t> order(expected.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return expected[a] < expected[b]; });
  ChiSquare result;
  double cells = 0, seen = 0, wanted = 0;
  const auto close_pool = [&] {
    result.statistic += (seen - wanted) * (seen - wanted) / wanted;
    seen = wanted = 0;
    ++cells;
  };
  for (const std::size_t i : order) {
    if (!(expected[i] >= 0) || (expected[i] == 0 && observed[i] != 0)) return result;
    seen += observed[i];
    wanted += expected[i];
    if (wanted >= least) close_pool();
  }
  if (wanted > 0) close_pool();
  result.degrees = cells - 1;
  // A single cell says only that all draws fell into it.
  result.p = result.degrees > 0 ? chi_square_p(result.statistic, result.degrees) : result.statistic < 1e-6 ? 1 : 0;
  return result;
}

}  // namespace tessera

#include "core/sampling/pixel_filter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/random.h"
#include "tests/support/statistics.h"

namespace tessera {
namespace {

/// A filter as its definition has it, in pixels from the centre along an axis.
struct Definition {
  std::string name;
  FilterKind kind;
  float width;
  double reach, variance;
  std::function<double(double)> cumulative;  ///< Integral from the centre, up to a factor.
};

constexpr std::array kHarris{0.35875, 0.48829, 0.14128, 0.01168};

Definition box(float width) {
  return {"box", FilterKind::box, width, width / 2, width * width / 12, [](double x) { return x; }};
}

Definition gaussian(float width) {
  const double sigma = width / 4;
  // Cut off at 4σ: what the tails would have added is missing (Johnson, Kotz & Balakrishnan 1994, ch. 13).
  const double inside = std::erf(4 / std::numbers::sqrt2);
  const double edge = std::exp(-8.0) / std::sqrt(2 * std::numbers::pi);
  return {
      "gaussian", FilterKind::gaussian, width, width, sigma * sigma * (1 - 2 * 4 * edge / inside), [sigma](double x) {
        return std::erf(x / sigma / std::numbers::sqrt2);
      }};
}

Definition blackman_harris(float width) {
  const double pi = std::numbers::pi;
  double second = kHarris[0] / 3;  // ∫ x² f over [0, 1], term by term
  for (int k = 1; k < 4; ++k)
    second += kHarris[static_cast<std::size_t>(k)] * (k % 2 == 0 ? 2 : -2) / (k * pi * k * pi);
  return {"blackman_harris",
          FilterKind::blackman_harris,
          width,
          width,
          width * width * second / kHarris[0],
          [width, pi](double x) {
            double sum = kHarris[0] * x / width;
            for (int k = 1; k < 4; ++k)
              sum += kHarris[static_cast<std::size_t>(k)] * std::sin(k * pi * x / width) / (k * pi);
            return sum;
          }};
}

std::vector<Definition> definitions() {
  return {box(1), box(0.25F), box(3), gaussian(1.5F), gaussian(4), blackman_harris(1.5F), blackman_harris(3)};
}

/// STRESS 63.
TEST(PixelFilter, OffsetsHaveTheFiltersMeanAndVariance_Stress63) {
  const auto all = definitions();
  const double level = sidak(0.01, 4.0 * static_cast<double>(all.size()));
  Random random(5);
  for (const Definition& want : all) {
    const PixelFilter filter(want.kind, want.width);
    EXPECT_EQ(filter.reach(), want.reach) << want.name;
    Moments x, y, x_squared, y_squared;
    for (int i = 0; i < 1'000'000; ++i) {
      const PixelOffset at = filter.sample({random.uniform(0, 1), random.uniform(0, 1)});
      const double dx = at.x - 0.5, dy = at.y - 0.5;
      ASSERT_LE(std::max(std::abs(dx), std::abs(dy)), want.reach) << want.name;
      x.add(dx);
      y.add(dy);
      x_squared.add(dx * dx);
      y_squared.add(dy * dy);
    }
    EXPECT_GT(t_test(x, 0), level) << want.name << ' ' << x.mean();
    EXPECT_GT(t_test(y, 0), level) << want.name << ' ' << y.mean();
    EXPECT_GT(t_test(x_squared, want.variance), level) << want.name << ' ' << x_squared.mean() << ' ' << want.variance;
    EXPECT_GT(t_test(y_squared, want.variance), level) << want.name << ' ' << y_squared.mean() << ' ' << want.variance;
  }
}

TEST(PixelFilter, OffsetsAreSpreadAsTheFilterIs) {
  const auto all = definitions();
  Random random(6);
  for (const Definition& want : all) {
    const PixelFilter filter(want.kind, want.width);
    const std::size_t cells = 100;
    const int count = 1'000'000;
    std::vector<double> observed(cells), expected;
    for (int i = 0; i < count; ++i) {
      const double at = filter.sample({random.uniform(0, 1), 0.5}).x - 0.5;
      ++observed[std::min(static_cast<std::size_t>((at / want.reach + 1) / 2 * cells), cells - 1)];
    }
    const auto edge = [&](std::size_t i) {
      return want.cumulative((2.0 * static_cast<double>(i) / cells - 1) * want.reach);
    };
    for (std::size_t i = 0; i < cells; ++i)
      expected.push_back(count * (edge(i + 1) - edge(i)) / (edge(cells) - edge(0)));
    EXPECT_GT(chi_square_test(observed, expected).p, sidak(0.01, static_cast<double>(all.size()))) << want.name;
  }
}

TEST(PixelFilter, AreSymmetricAndRiseWithTheirNumbers) {
  for (const Definition& want : definitions()) {
    const PixelFilter filter(want.kind, want.width);
    EXPECT_EQ(filter.sample({0.5, 0.5}).x, 0.5);
    EXPECT_EQ(filter.sample({0.5, 0.5}).y, 0.5);
    EXPECT_NEAR(filter.sample({0, 0}).x, 0.5 - want.reach, 1e-12) << want.name;
    EXPECT_NEAR(filter.sample({1 - 0x1p-53, 0}).x, 0.5 + want.reach, 1e-9) << want.name;
    double last = -want.reach;
    for (int i = 0; i < 10'000; ++i) {
      const double u = i / 10'000.0, at = filter.sample({u, 0.5}).x - 0.5;
      EXPECT_GE(at, last) << want.name << ' ' << u;
      last = at;
      if (i > 0) {
        EXPECT_NEAR(filter.sample({1 - u, 0.5}).x - 0.5, -at, 1e-9) << want.name << ' ' << u;
      }
    }
  }
}

TEST(PixelFilter, ABoxOfOnePixelLeavesSamplesWhereTheyAre) {
  for (const float width : {0.0F, 1.0F}) {
    const PixelFilter filter(FilterKind::box, width);
    for (int i = 0; i < 10'000; ++i) {
      Random random(i);
      const PixelOffset u{random.uniform(0, 1), random.uniform(0, 1) * random.magnitude(-16, 0)};
      EXPECT_EQ(filter.sample(u).x, u.x);
      EXPECT_EQ(filter.sample(u).y, u.y);
    }
  }
}

TEST(PixelFilter, NoWidthMeansTheKindsOwn) {
  EXPECT_EQ(PixelFilter(FilterKind::box, 0).reach(), 0.5);
  EXPECT_EQ(PixelFilter(FilterKind::gaussian, 0).reach(), 1.5);
  EXPECT_EQ(PixelFilter(FilterKind::blackman_harris, 0).reach(), 1.5);
}

}  // namespace
}  // namespace tessera

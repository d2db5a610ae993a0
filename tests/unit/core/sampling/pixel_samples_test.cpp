#include "core/sampling/pixel_samples.h"

#include <cmath>
#include <set>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>

namespace tessera {
namespace {

TEST(PixelSamples, AreInThePixelAndSpread) {
  double sum = 0, sum_of_squares = 0;
  const int n = 100'000;
  for (int i = 0; i < n; ++i) {
    const double v = uniform(1, static_cast<std::uint32_t>(i % 317), static_cast<std::uint32_t>(i / 317), 3, 0);
    ASSERT_TRUE(v >= 0 && v < 1);
    sum += v;
    sum_of_squares += v * v;
  }
  EXPECT_NEAR(sum / n, 0.5, 5 * std::sqrt(1.0 / 12 / n));
  EXPECT_NEAR(sum_of_squares / n, 1.0 / 3, 5 * std::sqrt(4.0 / 45 / n));
}

TEST(PixelSamples, DifferInEveryArgument) {
  std::set<double> values{uniform(1, 2, 3, 4, 5), uniform(2, 2, 3, 4, 5), uniform(1, 3, 3, 4, 5),
                          uniform(1, 2, 4, 4, 5), uniform(1, 2, 3, 5, 5), uniform(1, 2, 3, 4, 6)};
  EXPECT_EQ(values.size(), 6U);
  EXPECT_EQ(uniform(1, 2, 3, 4, 5), uniform(1, 2, 3, 4, 5));
}

TEST(PixelSamples, FillEveryCellOnce) {
  for (const auto& [count, across, down] : {std::tuple{16U, 4U, 4U}, {6U, 3U, 2U}, {7U, 7U, 1U}}) {
    std::set<std::pair<int, int>> cells;
    for (std::uint32_t i = 0; i < count; ++i) {
      const PixelOffset o = PixelOffsets(9, count, true).of(5, 6, i);
      cells.insert({static_cast<int>(o.x * across), static_cast<int>(o.y * down)});
    }
    EXPECT_EQ(cells.size(), count);
  }
}

TEST(PixelSamples, AreCentredWithoutJitter) {
  const PixelOffset o = PixelOffsets(9, 16, false).of(5, 6, 3);
  EXPECT_EQ(o.x, 0.5);
  EXPECT_EQ(o.y, 0.5);
}

}  // namespace
}  // namespace tessera

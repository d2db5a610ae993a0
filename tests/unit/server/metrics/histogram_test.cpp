#include "server/metrics/histogram.h"

#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr std::array kBounds{0.001, 0.01, 0.1};

TEST(Histogram, CountsByUpperBound) {
  Histogram histogram(kBounds);
  for (const nanoseconds time :
       {nanoseconds(-5), nanoseconds(0), nanoseconds(1'000'000), nanoseconds(1'000'001), nanoseconds(milliseconds(10)),
        nanoseconds(milliseconds(50)), nanoseconds(milliseconds(100)), nanoseconds(milliseconds(101))})
    histogram.add(time);
  const Histogram::Reading reading = histogram.read();
  ASSERT_EQ(reading.bounds.size(), 3u);
  EXPECT_EQ(reading.below[0], 3u);  // What takes as long as the bound is within it, as `le` says.
  EXPECT_EQ(reading.below[1], 5u);
  EXPECT_EQ(reading.below[2], 7u);
  EXPECT_EQ(reading.count, 8u);
  EXPECT_NEAR(reading.sum, 0.263000001, 1e-12);
}

TEST(Histogram, LosesNothingAmongThreads) {
  constexpr int kThreads = 4, kTimes = 20000;
  Histogram histogram(kBounds);
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < kThreads; ++i)
      threads.emplace_back([&, i] {
        for (int k = 0; k < kTimes; ++k) histogram.add(milliseconds(i % 2 == 0 ? 5 : 500));
      });
  }
  const Histogram::Reading reading = histogram.read();
  EXPECT_EQ(reading.below[1], static_cast<std::uint64_t>(kThreads / 2 * kTimes));
  EXPECT_EQ(reading.count, static_cast<std::uint64_t>(kThreads * kTimes));
  EXPECT_NEAR(reading.sum, kThreads / 2 * kTimes * 0.505, 1e-6);
}

}  // namespace
}  // namespace tessera::server

#include "tests/support/list_schedule.h"

#include <algorithm>
#include <numeric>

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

TEST(ListSchedule, GivesEachPieceToTheFirstFreeCore) {
  EXPECT_EQ(list_schedule(std::vector<double>{}, 3), 0);
  EXPECT_EQ(list_schedule(std::vector<double>{4, 1, 1, 1, 1}, 2), 4);
  EXPECT_EQ(list_schedule(std::vector<double>{1, 1, 1, 1, 4}, 2), 6) << "the longest comes last";
  EXPECT_EQ(list_schedule(std::vector<double>{2, 3}, 64), 3);
}

TEST(ListSchedule, StaysWithinGrahamsBounds) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    std::vector<double> durations(1 + seed);
    for (double& d : durations) d = random.uniform(0, 1);
    const double sum = std::accumulate(durations.begin(), durations.end(), 0.0);
    const double longest = *std::ranges::max_element(durations);
    EXPECT_NEAR(list_schedule(durations, 1), sum, 1e-12 * sum);
    for (const std::size_t cores : {2UL, 3UL, 8UL, 64UL}) {
      const double end = list_schedule(durations, cores), share = sum / static_cast<double>(cores);
      EXPECT_GE(end, std::max(longest, share) * (1 - 1e-12));
      EXPECT_LE(end, share + longest);
    }
  }
}

}  // namespace
}  // namespace tessera

#include "tests/support/statistics.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

// What other tests judge by, against closed forms and printed tables.

TEST(Statistics, MomentsAreThoseOfTheData) {
  Moments moments;
  for (const double v : {1e9 + 4, 1e9 + 7, 1e9 + 13, 1e9 + 16}) moments.add(v);
  EXPECT_EQ(moments.count(), 4);
  EXPECT_EQ(moments.mean(), 1e9 + 10);
  EXPECT_EQ(moments.variance(), 30);
  EXPECT_EQ(moments.variance_of_mean(), 7.5);
}

TEST(Statistics, NormalTails) {
  EXPECT_NEAR(normal_p(1.959963984540054), 0.05, 1e-12);
  EXPECT_NEAR(normal_p(-2.5758293035489004), 0.01, 1e-12);
  EXPECT_EQ(normal_p(0), 1);
}

TEST(Statistics, ChiSquareTails) {
  for (const double x : {1e-9, 0.3, 2.0, 7.0, 60.0}) {
    EXPECT_NEAR(chi_square_p(x, 2), std::exp(-x / 2), 1e-13) << x;
    EXPECT_NEAR(chi_square_p(x, 1), std::erfc(std::sqrt(x / 2)), 1e-12) << x;
    EXPECT_NEAR(chi_square_p(x, 6), std::exp(-x / 2) * (1 + x / 2 + x * x / 8), 1e-13) << x;
  }
  EXPECT_NEAR(chi_square_p(18.307038053275146, 10), 0.05, 1e-12);
  EXPECT_NEAR(chi_square_p(124.34211340400407, 100), 0.05, 1e-10);
  EXPECT_NEAR(chi_square_p(1e5, 1e5), 0.5, 1e-3);
  EXPECT_EQ(chi_square_p(0, 5), 1);
  EXPECT_EQ(chi_square_p(std::numeric_limits<double>::infinity(), 5), 0);
}

TEST(Statistics, StudentTails) {
  for (const double t : {1e-6, 0.4, 1.0, 3.0, 40.0, 1e6}) {
    EXPECT_NEAR(student_p(t, 1), 2 / std::numbers::pi * std::atan(1 / t), 1e-12) << t;
    EXPECT_NEAR(student_p(-t, 2), 1 - t / std::sqrt(2 + t * t), 1e-12) << t;
    EXPECT_NEAR(student_p(t, 1e7), normal_p(t), 1e-6) << t;
  }
  EXPECT_NEAR(student_p(2.570581835636314, 5), 0.05, 1e-12);
  EXPECT_EQ(student_p(0, 5), 1);
}

TEST(Statistics, SidakKeepsTheLevelOfAllTogether) {
  EXPECT_NEAR(1 - std::pow(1 - sidak(0.01, 1000), 1000), 0.01, 1e-12);
  EXPECT_EQ(sidak(0.01, 1), 0.01);
}

/// Draws of a standard normal (Box & Muller 1958).
double normal(Random& random) {
  return std::sqrt(-2 * std::log(1 - random.uniform(0, 1))) * std::cos(2 * std::numbers::pi * random.uniform(0, 1));
}

/// How often a test of what is true rejects at 5%: a binomial count.
template <class Test>
void expect_level_held(Test test) {
  int rejected = 0;
  const int trials = 2000;
  Random random(0);  // One for all: those of neighbouring seeds overlap.
  for (int i = 0; i < trials; ++i) {
    if (test(random) < 0.05) ++rejected;
  }
  EXPECT_NEAR(rejected, trials * 0.05, 4 * std::sqrt(trials * 0.05 * 0.95));
}

TEST(Statistics, TestsHoldTheirLevelAndFindWhatIsWrong) {
  const auto sample = [](Random& random, int count, double mean, double deviation) {
    Moments moments;
    for (int i = 0; i < count; ++i) moments.add(mean + deviation * normal(random));
    return moments;
  };
  expect_level_held([&](Random& random) { return t_test(sample(random, 6, 3, 2), 3); });
  expect_level_held([&](Random& random) { return welch_test(sample(random, 8, 3, 2), sample(random, 30, 3, 0.5)); });
  Random random(0);
  EXPECT_LT(t_test(sample(random, 100, 3, 1), 4), 1e-6);
  EXPECT_LT(welch_test(sample(random, 100, 3, 1), sample(random, 100, 4, 2)), 1e-4);
  EXPECT_EQ(t_test(sample(random, 10, 3, 0), 3), 1);
  EXPECT_EQ(t_test(sample(random, 10, 3, 0), 4), 0);
  EXPECT_EQ(t_test(sample(random, 10, std::nan(""), 1), 4), 0);
}

TEST(Statistics, GoodnessOfFitHoldsItsLevelAndFindsWhatIsWrong) {
  const std::vector<double> shares{0.001, 0.5, 0.002, 0.25, 0.2, 0.047};
  const auto draw = [&](Random& random) {
    std::vector<double> observed(shares.size());
    for (int i = 0; i < 1000; ++i) {
      double u = random.uniform(0, 1);
      std::size_t cell = 0;
      while (cell + 1 < shares.size() && u >= shares[cell]) u -= shares[cell++];
      ++observed[cell];
    }
    return observed;
  };
  std::vector<double> expected;
  for (const double share : shares) expected.push_back(1000 * share);
  expect_level_held([&](Random& random) { return chi_square_test(draw(random), expected).p; });
  // 1 and 2 go together with 47.
  Random random(0);
  EXPECT_EQ(chi_square_test(draw(random), expected).degrees, 3);
  EXPECT_LT(chi_square_test(std::vector<double>{40, 450, 2, 250, 200, 58}, expected).p, 1e-3);
  EXPECT_EQ(chi_square_test(std::vector<double>{1, 9}, std::vector<double>{0, 10}).p, 0);
  EXPECT_EQ(chi_square_test(std::vector<double>{0, 10}, std::vector<double>{0, 10}).p, 1);
  EXPECT_EQ(chi_square_test(std::vector<double>{0, 9}, std::vector<double>{0, 10}).p, 0);
}

}  // namespace
}  // namespace tessera

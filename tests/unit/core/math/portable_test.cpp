#include "core/math/portable.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

constexpr int kPoints = 200'000;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

/// How far `got` is from `want`, in units of the last place of a T of that size.
template <class T>
double ulps(T got, long double want) {
  if (got == want) return 0;
  const T size = std::abs(static_cast<T>(want));
  return static_cast<double>(std::abs(got - want) / (std::nextafter(size, std::numeric_limits<T>::infinity()) - size));
}

void expect_good_trigonometry(double x) {
  const long double wide = x;
  EXPECT_LE(ulps(portable_sin(x), std::sin(wide)), 2) << x;
  EXPECT_LE(ulps(portable_cos(x), std::cos(wide)), 2) << x;
  EXPECT_LE(ulps(portable_tan(x), std::tan(wide)), 2) << x;
}

TEST(Portable, SineCosineAndTangentAreCloseToLongDouble) {
  for (int i = 0; i < kPoints && !testing::Test::HasFailure(); ++i) {
    Random random(i);
    const double reach = i % 2 == 0 ? 4 * std::numbers::pi : std::pow(2, random.uniform(-60, 3));
    expect_good_trigonometry(random.uniform(-reach, reach));
  }
}

TEST(Portable, SineCosineAndTangentKeepTheirDigitsBesideTheirZerosAndPoles) {
  for (int eighth = -31; eighth <= 31; ++eighth) {
    const double x = eighth * std::numbers::pi / 8;
    for (const double near : {x, std::nextafter(x, kInf), std::nextafter(x, -kInf)}) expect_good_trigonometry(near);
  }
}

TEST(Portable, TrigonometryAtItsEdges) {
  EXPECT_EQ(portable_sin(0), 0);
  EXPECT_EQ(portable_cos(0), 1);
  EXPECT_EQ(portable_tan(0), 0);
  EXPECT_EQ(portable_atan(0), 0);
  EXPECT_EQ(portable_atan(1), std::numbers::pi / 4);
  EXPECT_EQ(portable_atan(kInf), std::numbers::pi / 2);
  EXPECT_EQ(portable_atan(-kInf), -std::numbers::pi / 2);
  expect_good_trigonometry(4 * std::numbers::pi);
  expect_good_trigonometry(-4 * std::numbers::pi);
  for (const double bad : {kNan, kInf, -kInf, 12.6, -12.6}) {
    EXPECT_TRUE(std::isnan(portable_sin(bad))) << bad;
    EXPECT_TRUE(std::isnan(portable_cos(bad))) << bad;
    EXPECT_TRUE(std::isnan(portable_tan(bad))) << bad;
  }
  EXPECT_TRUE(std::isnan(portable_atan(kNan)));
}

TEST(Portable, ArcTangentIsCloseToLongDouble) {
  for (int i = 0; i < kPoints && !testing::Test::HasFailure(); ++i) {
    Random random(i);
    const double x = i % 2 == 0 ? random.uniform(-3, 3) : std::pow(2, random.uniform(-60, 60));
    EXPECT_LE(ulps(portable_atan(x), std::atan(static_cast<long double>(x))), 2) << i << ' ' << x;
  }
}

TEST(Portable, LogarithmAndExponentialAreCloseToLongDouble) {
  for (int i = 0; i < kPoints && !testing::Test::HasFailure(); ++i) {
    Random random(i);
    const double x = i % 2 == 0 ? random.uniform(0.5, 2) : std::pow(2, random.uniform(-1074, 1023));
    EXPECT_LE(ulps(portable_log2(x), std::log2(static_cast<long double>(x))), 4) << i << ' ' << x;
    const double y = random.uniform(-1022, 1024);
    EXPECT_LE(ulps(portable_exp2(y), std::exp2(static_cast<long double>(y))), 2) << i << ' ' << y;
  }
}

TEST(Portable, LogarithmAndExponentialAreExactAtWholePowers) {
  for (int n = -1074; n < 1024; ++n) {
    EXPECT_EQ(portable_exp2(n), std::ldexp(1.0, n)) << n;
    EXPECT_EQ(portable_log2(std::ldexp(1.0, n)), n) << n;
  }
  EXPECT_EQ(portable_exp2(1024), kInf);
  EXPECT_EQ(portable_exp2(kInf), kInf);
  EXPECT_EQ(portable_exp2(-kInf), 0);
  EXPECT_TRUE(std::isnan(portable_exp2(kNan)));
  EXPECT_EQ(portable_log2(0), -kInf);
  EXPECT_EQ(portable_log2(kInf), kInf);
  EXPECT_TRUE(std::isnan(portable_log2(-1)));
  EXPECT_TRUE(std::isnan(portable_log2(kNan)));
}

TEST(Portable, PowerIsCloseToLongDouble) {
  for (int i = 0; i < kPoints && !testing::Test::HasFailure(); ++i) {
    Random random(i);
    // Bases spread from 0 to 1, crowded below 1, and above it as colours are.
    const double share = random.uniform(0, 1), crowded = 1 - share * std::pow(2, random.uniform(-24, 0));
    const auto base = static_cast<float>(i % 3 == 0 ? share : i % 3 == 1 ? crowded : 1000 * share);
    const auto exponent = static_cast<float>(i % 3 == 2 ? random.uniform(0, 10) : std::pow(2, random.uniform(-10, 30)));
    const long double exact = std::pow(static_cast<long double>(base), static_cast<long double>(exponent));
    EXPECT_LE(ulps(portable_pow(base, exponent), exact), 1) << i << ' ' << base << '^' << exponent;
  }
}

TEST(Portable, PowerAtItsEdges) {
  for (const float exponent : {1e-45F, 0.5F, 1.0F, 2.4F, 1e9F, std::numeric_limits<float>::max()}) {
    EXPECT_EQ(portable_pow(0, exponent), 0) << exponent;
    EXPECT_EQ(portable_pow(1, exponent), 1) << exponent;
  }
  for (const float base : {0.0F, 1e-45F, 0.3F, 1.0F, 1000.0F}) EXPECT_EQ(portable_pow(base, 0), 1) << base;
  for (const float base : {1e-45F, 0.1F, 0.3F, 0.99999994F, 1000.0F}) EXPECT_EQ(portable_pow(base, 1), base);
  EXPECT_EQ(portable_pow(0.99F, 1e9F), 0);
  EXPECT_EQ(portable_pow(10, 39), std::numeric_limits<float>::infinity());
  EXPECT_TRUE(std::isnan(portable_pow(std::numeric_limits<float>::quiet_NaN(), 2)));
}

/// A change of any bit changes every picture: it has to be meant, and this number with it.
TEST(Portable, EveryMachineComputesTheseBits) {
  std::uint64_t hash = 14695981039346656037ULL;  // FNV-1a by words, with a shift so that high bits reach low ones.
  const auto add = [&](std::uint64_t bits) {
    hash = (hash ^ bits) * 1099511628211ULL;
    hash ^= hash >> 29;
  };
  for (int i = 0; i < 100'000; ++i) {
    const double x = (i - 50'000) / 4096.0;
    for (const double y : {portable_sin(x), portable_cos(x), portable_tan(x), portable_atan(x), portable_exp2(x),
                           portable_log2((i + 1) / 4096.0)})
      add(std::bit_cast<std::uint64_t>(y));
    add(std::bit_cast<std::uint32_t>(portable_pow(static_cast<float>(i) / 1e5F, static_cast<float>(i) / 512.0F)));
  }
  EXPECT_EQ(hash, 0x94f207879e200f01ULL);
}

}  // namespace
}  // namespace tessera

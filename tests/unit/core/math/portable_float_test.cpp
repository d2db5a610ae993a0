#include "core/math/portable_float.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/random.h"

namespace tessera {
namespace {

constexpr float kFloatNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kFloatInf = std::numeric_limits<float>::infinity();
constexpr float kFloatPi = std::numbers::pi_v<float>;
constexpr long double kWidePi = std::numbers::pi_v<long double>;

/// What the header promises. The difference, in units of the last place that a float of the wanted size has.
void expect_close(float got, long double want, const char* what, float at) {
  const float size = std::abs(static_cast<float>(want));
  const long double ulp = static_cast<long double>(std::nextafter(size, kFloatInf)) - size;
  EXPECT_LE(std::abs(got - want), 0.51L * ulp) << what << " of " << at << ": " << got;
}

int points() { return effort(200'000, 5'000'000); }

TEST(PortableFloat, SineAndCosineOfTurnsAreCloseToLongDouble) {
  for (int i = 0; i < points() && !testing::Test::HasFailure(); ++i) {
    Random random(i);
    const auto turns = static_cast<float>(i % 2 == 0 ? random.uniform(-2, 2) : random.magnitude(-30, 6));
    const auto [s, c] = sin_cos_turns(turns);
    // Whole quarters are taken off exactly: near them, 2π times the rest of the turn isn't precise enough.
    const long double quarters = std::nearbyint(4 * static_cast<long double>(turns));
    const long double rest = 2 * kWidePi * (turns - quarters / 4);
    const long double sine = std::sin(rest), cosine = std::cos(rest);
    const int quadrant = static_cast<int>(quarters) & 3;
    expect_close(s, quadrant == 0 ? sine : quadrant == 1 ? cosine : quadrant == 2 ? -sine : -cosine, "sine", turns);
    expect_close(c, quadrant == 0 ? cosine : quadrant == 1 ? -sine : quadrant == 2 ? -cosine : sine, "cosine", turns);
  }
}

TEST(PortableFloat, QuartersOfATurnAreExact) {
  for (int quarter = -4000; quarter <= 4000; ++quarter) {
    const auto [s, c] = sin_cos_turns(static_cast<float>(quarter) / 4);
    EXPECT_EQ(s, quarter % 2 == 0 ? 0 : (quarter & 3) == 1 ? 1 : -1) << quarter;
    EXPECT_EQ(c, quarter % 2 != 0 ? 0 : (quarter & 3) == 0 ? 1 : -1) << quarter;
  }
}

TEST(PortableFloat, SineAndCosineAreCloseToLongDouble) {
  for (int i = 0; i < points() && !testing::Test::HasFailure(); ++i) {
    Random random(i);
    // Near multiples of π/2, anywhere near 0, and of all sizes.
    const int n = static_cast<int>(random.uniform(-40'000, 40'000));
    const auto x = static_cast<float>(i % 3 == 0   ? n * (std::numbers::pi / 2)
                                      : i % 3 == 1 ? random.uniform(-10, 10)
                                                   : random.magnitude(-38, 4.8));
    const auto [s, c] = portable_sin_cos(x);
    expect_close(s, std::sin(static_cast<long double>(x)), "sine", x);
    expect_close(c, std::cos(static_cast<long double>(x)), "cosine", x);
  }
}

TEST(PortableFloat, ArcFunctionsAreCloseToLongDouble) {
  for (int i = 0; i < points() && !testing::Test::HasFailure(); ++i) {
    Random random(i);
    const double sign = random.uniform(-1, 1) < 0 ? -1 : 1;
    const double near_0 = random.magnitude(-40, 0), near_1 = 1 - random.magnitude(-7, 0);
    const auto x = static_cast<float>(sign * (i % 3 == 0 ? random.uniform(0, 1) : i % 3 == 1 ? near_0 : near_1));
    expect_close(portable_acos(x), std::acos(static_cast<long double>(x)), "arc cosine", x);
    const auto y = static_cast<float>(random.uniform(-1, 1) * (i % 2 == 0 ? 1 : random.magnitude(-38, 38)));
    expect_close(portable_atan2(y, x), std::atan2(static_cast<long double>(y), static_cast<long double>(x)),
                 "arc tangent", y / x);
  }
}

TEST(PortableFloat, ArcFunctionsAtTheirEdges) {
  EXPECT_EQ(portable_acos(1), 0);
  EXPECT_EQ(portable_acos(-1), kFloatPi);
  EXPECT_EQ(portable_acos(0), kFloatPi / 2);
  EXPECT_EQ(portable_acos(1.0001F), 0);
  EXPECT_EQ(portable_acos(-kFloatInf), kFloatPi);
  EXPECT_EQ(portable_atan2(0, 0), 0);
  EXPECT_EQ(portable_atan2(0, 1), 0);
  EXPECT_EQ(portable_atan2(1, 0), kFloatPi / 2);
  EXPECT_EQ(portable_atan2(-1, 0), -kFloatPi / 2);
  EXPECT_EQ(portable_atan2(0, -1), kFloatPi);
  EXPECT_EQ(portable_atan2(-0.0F, -1), -kFloatPi);
  EXPECT_EQ(portable_atan2(2, 2), kFloatPi / 4);
  EXPECT_EQ(portable_atan2(-2, -2), -3 * kFloatPi / 4);
  EXPECT_EQ(portable_atan2(1, kFloatInf), 0);
  EXPECT_EQ(portable_atan2(-kFloatInf, 1), -kFloatPi / 2);
  EXPECT_EQ(portable_atan2(1e-45F, 1e-45F), kFloatPi / 4);
  EXPECT_EQ(portable_atan2(3e38F, 3e38F), kFloatPi / 4);
  EXPECT_TRUE(std::isnan(portable_atan2(kFloatInf, kFloatInf)));
}

TEST(PortableFloat, NanStaysNan) {
  EXPECT_TRUE(std::isnan(sin_cos_turns(kFloatNan).sin));
  EXPECT_TRUE(std::isnan(sin_cos_turns(kFloatNan).cos));
  EXPECT_TRUE(std::isnan(portable_sin_cos(kFloatNan).sin));
  EXPECT_TRUE(std::isnan(portable_sin_cos(kFloatNan).cos));
  EXPECT_TRUE(std::isnan(portable_acos(kFloatNan)));
  EXPECT_TRUE(std::isnan(portable_atan2(kFloatNan, 1)));
  EXPECT_TRUE(std::isnan(portable_atan2(1, kFloatNan)));
}

/// A change of any bit changes pictures: it has to be meant, and this number with it.
TEST(PortableFloat, EveryMachineComputesTheseBits) {
  std::uint64_t hash = 14695981039346656037ULL;  // FNV-1a by words, with a shift so that high bits reach low ones.
  for (int i = 0; i < 100'000; ++i) {
    const float x = static_cast<float>(i - 50'000) / 4096, unit = static_cast<float>(i) / 1e5F;
    const auto [s, c] = sin_cos_turns(x);
    const auto [sine, cosine] = portable_sin_cos(x);
    for (const float y : {s, c, sine, cosine, portable_acos(unit), portable_atan2(x, unit)}) {
      hash = (hash ^ std::bit_cast<std::uint32_t>(y)) * 1099511628211ULL;
      hash ^= hash >> 29;
    }
  }
  EXPECT_EQ(hash, 0x786cf485291b7d3bULL);
}

}  // namespace
}  // namespace tessera

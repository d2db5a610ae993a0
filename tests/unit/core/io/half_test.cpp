#include "core/io/half.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace tessera {
namespace {

/// By the definition of binary16. Precondition: finite.
double value_of(std::uint32_t bits) {
  const int exponent = static_cast<int>(bits >> 10 & 31);
  const double fraction = (bits & 1023) / 1024.0;
  return exponent == 0 ? std::ldexp(fraction, -14) : std::ldexp(1 + fraction, exponent - 15);
}

TEST(Half, IsTheNearestOneForEveryStep) {
  for (std::uint32_t bits = 0; bits < 0x7BFF; ++bits) {
    const auto here = static_cast<float>(value_of(bits)), next = static_cast<float>(value_of(bits + 1));
    const float middle = (here + next) / 2;  // exact
    ASSERT_EQ(half_bits(here), bits);
    ASSERT_EQ(half_bits(-here), bits | 0x8000);
    ASSERT_EQ(half_bits(std::nextafter(middle, 0.0F)), bits);
    ASSERT_EQ(half_bits(middle), bits % 2 == 0 ? bits : bits + 1) << "ties to even";
    ASSERT_EQ(half_bits(std::nextafter(middle, 1e5F)), bits + 1);
  }
}

TEST(Half, BeyondItsEnds) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  for (const float large : {65504.0F, 65505.0F, 65520.0F, 1e6F, 3.4e38F}) {
    EXPECT_EQ(half_bits(large), 0x7BFF) << large;
    EXPECT_EQ(half_bits(-large), 0xFBFF) << large;
  }
  EXPECT_EQ(half_bits(kInf), 0x7C00);
  EXPECT_EQ(half_bits(-kInf), 0xFC00);
  EXPECT_GT(half_bits(std::numeric_limits<float>::quiet_NaN()) & 0x7FFF, 0x7C00);
  EXPECT_EQ(half_bits(-0.0F), 0x8000);
  for (const float tiny : {1e-45F, 1e-30F, 0x1p-25F}) EXPECT_EQ(half_bits(tiny), 0) << tiny;
  EXPECT_EQ(half_bits(std::nextafter(0x1p-25F, 1.0F)), 1);
}

}  // namespace
}  // namespace tessera

#include "core/io/display_curve.h"

#include <bit>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace tessera {
namespace {

/// 255 times the curve, before rounding.
long double curve(float linear) {
  const long double v = linear;
  return 255 * (v <= 0.0031308L ? 12.92L * v : 1.055L * std::pow(v, 1 / 2.4L) - 0.055L);
}

TEST(DisplayByte, IsTheRoundedCurveForEveryFloatNearAStep) {
  int steps = 0;
  std::uint8_t last = 0;
  // Every 97th float from 2^-20 to 1: some 1.7 million, of which thousands lie on either side of each step.
  for (std::uint32_t bits = std::bit_cast<std::uint32_t>(0x1p-20F); bits <= std::bit_cast<std::uint32_t>(1.0F);
       bits += 97) {
    const auto linear = std::bit_cast<float>(bits);
    const std::uint8_t byte = display_byte(linear);
    ASSERT_LE(std::abs(static_cast<long double>(byte) - curve(linear)), 0.5L + 1e-12L) << linear;
    ASSERT_GE(byte, last) << linear;
    steps += byte != last;
    last = byte;
  }
  EXPECT_EQ(steps, 255);
}

TEST(DisplayByte, ClampsAndTakesNanForBlack) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  for (const float black : {0.0F, -0.0F, -1.0F, -kInf, std::numeric_limits<float>::quiet_NaN(), 1e-45F, 1e-30F})
    EXPECT_EQ(display_byte(black), 0) << black;
  for (const float white : {std::nextafter(1.0F, 0.0F), 1.0F, 1.5F, kInf}) EXPECT_EQ(display_byte(white), 255) << white;
  EXPECT_EQ(display_byte(0.5F), 188);
}

TEST(DisplayLight, IsWhatTheByteIsMadeOf) {
  for (int byte = 0; byte < 256; ++byte) {
    const float light = display_light(static_cast<std::uint8_t>(byte));
    EXPECT_EQ(display_byte(light), byte);
    EXPECT_NEAR(static_cast<double>(curve(light)), byte, 1e-4);
  }
  EXPECT_EQ(display_light(0), 0);
  EXPECT_EQ(display_light(255), 1);
}

}  // namespace
}  // namespace tessera

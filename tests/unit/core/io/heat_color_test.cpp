#include "core/io/heat_color.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace tessera {
namespace {

using Bytes = std::array<std::uint8_t, 3>;

/// CIE L* of an sRGB colour, 0..100.
double lightness(Bytes color) {
  const auto linear = [](double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); };
  const double y =
      0.2126 * linear(color[0] / 255.0) + 0.7152 * linear(color[1] / 255.0) + 0.0722 * linear(color[2] / 255.0);
  return y > 216.0 / 24389 ? 116 * std::cbrt(y) - 16 : y * 24389 / 27;
}

TEST(HeatColor, RunsFromBlackToWhite) {
  EXPECT_EQ(heat_color(0), (Bytes{0, 0, 0}));
  EXPECT_EQ(heat_color(1), (Bytes{255, 255, 255}));
  EXPECT_EQ(heat_color(-3), heat_color(0));
  EXPECT_EQ(heat_color(7), heat_color(1));
  EXPECT_EQ(heat_color(std::numeric_limits<double>::quiet_NaN()), heat_color(0));
}

TEST(HeatColor, LightnessGrowsEvenly) {
  for (int i = 0; i <= 1000; ++i) EXPECT_NEAR(lightness(heat_color(i / 1000.0)), i / 10.0, 2) << i;
}

}  // namespace
}  // namespace tessera

#include "core/io/tone_map.h"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "core/io/display_curve.h"

namespace tessera {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();

void expect_near(Rgb found, Rgb expected, double bound) {
  EXPECT_NEAR(found.r, expected.r, bound);
  EXPECT_NEAR(found.g, expected.g, bound);
  EXPECT_NEAR(found.b, expected.b, bound);
}

TEST(ToneMap, NoneLeavesRadianceAlone) {
  const Display display({});
  for (const Rgb c : {Rgb{}, Rgb{0.5F, 1, 2}, Rgb{3e38F, 1e-40F, -1}}) EXPECT_EQ(display(c), c);
}

TEST(ToneMap, AStopIsTwiceTheLight) {
  EXPECT_EQ(Display({1, ToneMap::none})({0.25F, 0.5F, 3}), (Rgb{0.5F, 1, 6}));
  EXPECT_EQ(Display({-3, ToneMap::none})({8, 1, 0}), (Rgb{1, 0.125F, 0}));
  expect_near(Display({0.5F, ToneMap::none})({1, 1, 1}), {1.41421356F, 1.41421356F, 1.41421356F}, 1e-6);
  for (const ToneMap map : {ToneMap::khronos_pbr_neutral, ToneMap::aces})
    EXPECT_EQ(Display({2, map})({0.1F, 0.2F, 0.4F}), Display({0, map})({0.4F, 0.8F, 1.6F}));
}

// By hand from the specification's formulas (F90 = 0.04, start of compression 0.8 - 0.04, desaturation 0.15).
TEST(ToneMap, KhronosPbrNeutral) {
  const Display display({0, ToneMap::khronos_pbr_neutral});
  EXPECT_EQ(display({}), Rgb{});
  // From 0.08 on the offset is 0.04.
  expect_near(display({0.5F, 0.3F, 0.1F}), {0.46F, 0.26F, 0.06F}, 1e-6);
  // Below it the least channel x becomes 6.25 x²: 0.04 becomes 0.01, so the offset is 0.03.
  expect_near(display({0.5F, 0.04F, 0.2F}), {0.47F, 0.01F, 0.17F}, 1e-6);
  // The brightest colour that is only shifted.
  expect_near(display({0.8F, 0.8F, 0.8F}), {0.76F, 0.76F, 0.76F}, 1e-6);
  // A grey of 10: peak 9.96, shown 1 - 0.24² / (9.96 + 0.24 - 0.76) = 0.9938983; grey stays grey.
  expect_near(display({10, 10, 10}), {0.9938983F, 0.9938983F, 0.9938983F}, 1e-6);
  // A red of 10: no offset; peak 10, shown 1 - 0.0576 / 9.48 = 0.9939241, white 1 - 1 / (0.15 · 9.0060759 + 1) =
  // 0.5746331.
  expect_near(display({10, 0, 0}), {0.9939241F, 0.5711416F, 0.5711416F}, 1e-6);
}

// Greys: the matrices' rows add up to 1, so that a grey passes the curve alone, (v (v + 0.0245786) - 0.000090537) /
// (v (0.983729 v + 0.4329510) + 0.238081).
TEST(ToneMap, Aces) {
  const Display display({0, ToneMap::aces});
  expect_near(display({1, 1, 1}), {0.619115F, 0.619115F, 0.619115F}, 2e-5);
  expect_near(display({0.18F, 0.18F, 0.18F}), {0.105591F, 0.105591F, 0.105591F}, 2e-5);
  // A red of 1: the curve of 0.59719, 0.076, 0.0284 is 0.4380383, 0.0273015, 0.0056299.
  expect_near(display({1, 0, 0}), {0.6880279F, -0.0144954F, 0.0026390F}, 1e-6);
  EXPECT_EQ(display_byte(display({}).r), 0) << "the curve of 0 is a little below it";
}

TEST(ToneMap, RisesAndNearsWhite) {
  for (const ToneMap map : {ToneMap::khronos_pbr_neutral, ToneMap::aces}) {
    const Display display({0, map});
    float last = -1;
    for (float v = 0; v < 100; v += 0.01F) {
      const Rgb grey = display({v, v, v});
      ASSERT_GE(grey.r, last) << v;
      ASSERT_NEAR(grey.r, grey.b, 2e-5) << v;
      last = grey.r;
    }
    EXPECT_GT(last, 0.99F);
  }
}

TEST(ToneMap, NothingComesOfNanAndTheGreatestOfInfinity) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (const ToneMap map : {ToneMap::khronos_pbr_neutral, ToneMap::aces})
    for (const float exposure : {-kMostStops, 0.0F, kMostStops}) {
      const Display display({exposure, map});
      for (const float odd : {kNan, kInf, -kInf, -1.0F, 3e38F, 1e-45F}) {
        const Rgb one = display({odd, 0.5F, odd}), all = display({odd, odd, odd});
        for (const float v : {one.r, one.g, one.b, all.r, all.g, all.b}) {
          EXPECT_GE(v, -0.6F) << odd;
          EXPECT_LE(v, 1.7F) << odd;
        }
      }
      EXPECT_EQ(display_byte(display({kNan, kNan, kNan}).g), 0);
      EXPECT_GE(display_byte(display({kInf, kInf, kInf}).g), 254);
    }
}

}  // namespace
}  // namespace tessera

#include "core/accel/wide/wide_layout.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/exact_sum.h"

namespace tessera {
namespace {

float step_over(float lo, float hi) {
  const Aabb box{{lo, lo, lo}, {hi, hi, hi}};
  return make_wide_node({&box, 1}).step[0];
}

/// A box that reaches beyond a line of the lattice by less than any quotient of doubles can tell.
TEST(WideLayout, BoxesHoldWhatRoundingHides) {
  for (const float step : {1.0F, 1.7F, 3e10F}) {
    const float lo = -128 * step, least = 0x1p-149F;
    float hi = 127 * step;
    while (step_over(lo, hi) > step) hi = std::nextafter(hi, 0.0F);
    ASSERT_EQ(step_over(lo, hi), step);
    const Aabb boxes[] = {
        {{lo, lo, lo}, {hi, hi, hi}}, {{lo, lo, lo}, {least, least, least}}, {{-least, 0, 0}, {hi, hi, hi}}};
    const WideNode node = make_wide_node(boxes);
    EXPECT_GE(compare_sum(lo, node.hi[0][1] * double{step}, least), 0);
    EXPECT_LE(compare_sum(lo, node.lo[0][2] * double{step}, -least), 0);
  }
}

TEST(WideLayout, StepsAreNeverDenormal) {
  EXPECT_TRUE(std::isnormal(step_over(0, 0)));
  EXPECT_TRUE(std::isnormal(step_over(0, 0x1p-140F)));
  EXPECT_TRUE(std::isnormal(step_over(-1e18F, 1e18F)));
}

}  // namespace
}  // namespace tessera

#include "core/math/float_environment.h"

#include <gtest/gtest.h>

#include "tests/support/flush_to_zero.h"

namespace tessera {
namespace {

/// Out of the compiler's sight, so that the processor computes.
float product(float a, float b) {
  const volatile float x = a, y = b;
  return x * y;
}

TEST(StrictFloats, KeepDenormalsAndGiveTheCallersSettingsBack_Stress20) {
  if (!FlushToZero::kKnown) GTEST_SKIP() << "no switch to flush to zero is known for this machine";
  const FlushToZero on;
  ASSERT_EQ(product(1e-30F, 1e-10F), 0) << "results are flushed";
  ASSERT_EQ(product(1e-40F, 1e10F), 0) << "denormals are taken for zero";
  {
    const StrictFloats strict;
    EXPECT_GT(product(1e-30F, 1e-10F), 0);
    EXPECT_GT(product(1e-40F, 1e10F), 0);
    { const StrictFloats within; }
    EXPECT_GT(product(1e-40F, 1e10F), 0);
  }
  EXPECT_EQ(product(1e-30F, 1e-10F), 0);
  EXPECT_EQ(product(1e-40F, 1e10F), 0);
}

TEST(StrictFloats, RoundToNearest) {
  std::fesetround(FE_UPWARD);
  EXPECT_GT(product(1 + 0x1p-23F, 1 + 0x1p-23F), 1 + 0x1p-22F);
  {
    const StrictFloats strict;
    EXPECT_EQ(product(1 + 0x1p-23F, 1 + 0x1p-23F), 1 + 0x1p-22F);
  }
  EXPECT_EQ(std::fegetround(), FE_UPWARD);
  std::fesetround(FE_TONEAREST);
}

}  // namespace
}  // namespace tessera

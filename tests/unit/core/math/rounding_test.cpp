#include "core/math/rounding.h"

#include <gtest/gtest.h>

#include "core/math/vec.h"

namespace tessera {
namespace {

[[gnu::noinline]] Vec3d through_float(Vec3d v) { return to_double(to_float(v)); }

/// Fails when built by GCC 12 with its straight-line vectoriser: a pair of conversions there and back vanishes.
TEST(Rounding, ToFloatAndBackRounds) {
  const Vec3d third = through_float({1.0 / 3, 2.0 / 3, 4.0 / 3});
  EXPECT_EQ(third, (Vec3d{0x1.555556p-2, 0x1.555556p-1, 0x1.555556p+0}));
}

}  // namespace
}  // namespace tessera

#pragma once

#include <gtest/gtest.h>

#include "core/math/vec.h"

namespace tessera {

inline void expect_close(Vec3d actual, Vec3d expected, double tolerance = 1e-12) {
  EXPECT_NEAR(actual.x, expected.x, tolerance);
  EXPECT_NEAR(actual.y, expected.y, tolerance);
  EXPECT_NEAR(actual.z, expected.z, tolerance);
}

}  // namespace tessera

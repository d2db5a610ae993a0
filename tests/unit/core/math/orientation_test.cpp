#include "core/math/orientation.h"

#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

constexpr float kLargest = std::numeric_limits<float>::max(), kSmallest = std::numeric_limits<float>::denorm_min();

TEST(Orientation, HasTheSideThatTheNormalPointsTo) {
  const Vec3 a{0, 0, 0}, b{1, 0, 0}, c{0, 1, 0};
  EXPECT_EQ(orientation(a, b, c, {0, 0, 1}), 1);
  EXPECT_EQ(orientation(a, b, c, {5, -7, -1}), -1);
  EXPECT_EQ(orientation(a, b, c, {5, -7, 0}), 0);
  EXPECT_EQ(orientation_along(2, a, b, c), 1);
  EXPECT_EQ(orientation_along(2, a, c, b), -1);
  EXPECT_EQ(orientation_along(0, a, b, c), 0);
  EXPECT_EQ(orientation_along(1, {0, 0, 0}, {0, 0, 1}, {1, 0, 0}), 1);
}

/// Every permutation has the sign of its parity: true of exact signs alone.
void expect_consistent(const std::array<Vec3, 4>& p, int expected) {
  EXPECT_EQ(orientation(p[0], p[1], p[2], p[3]), expected);
  EXPECT_EQ(orientation(p[1], p[2], p[0], p[3]), expected);
  EXPECT_EQ(orientation(p[1], p[0], p[2], p[3]), -expected);
  EXPECT_EQ(orientation(p[3], p[1], p[2], p[0]), -expected);
  EXPECT_EQ(orientation(p[0], p[1], p[3], p[2]), -expected);
  EXPECT_EQ(orientation(p[1], p[0], p[3], p[2]), expected);
}

/// Whole numbers below 2^18: the determinant fits into 64 bits.
std::int64_t volume(const std::array<Vec3, 4>& p) {
  std::int64_t v[3][3];
  for (int i = 0; i < 3; ++i)
    for (int axis = 0; axis < 3; ++axis)
      v[i][axis] = static_cast<std::int64_t>(p[i + 1][axis]) - static_cast<std::int64_t>(p[0][axis]);
  std::int64_t sum = 0;
  for (int j = 0; j < 3; ++j) {
    const int k = (j + 1) % 3, l = (j + 2) % 3;
    sum += (v[0][j] * v[1][k] - v[0][k] * v[1][j]) * v[2][l];
  }
  return sum;
}

/// Nearly coplanar points: d is close to a mix of the others. All scaled by a power of two, to every end of the range.
TEST(Orientation, IsExact) {
  int zeros = 0, close = 0;
  for (int seed = 0; seed < 200'000; ++seed) {
    Random random(seed);
    const double size = std::round(random.magnitude(0, 5));
    std::array<Vec3, 4> p;
    for (Vec3& each : p)
      for (int axis = 0; axis < 3; ++axis) each[axis] = static_cast<float>(std::round(random.uniform(-size, size)));
    if (random.bits() % 2)
      for (int axis = 0; axis < 3; ++axis) p[3][axis] = std::round((p[0][axis] + p[1][axis] + p[2][axis]) / 3);
    const std::int64_t exact = volume(p);
    zeros += exact == 0;
    close += exact != 0 && std::abs(exact) < 10;
    const int expected = (exact > 0) - (exact < 0);
    const int exponent = static_cast<int>(random.bits() % 240) - 149;  // from denormals up
    for (Vec3& each : p)
      for (int axis = 0; axis < 3; ++axis) each[axis] = std::ldexp(each[axis], exponent);
    expect_consistent(p, expected);
    if (HasFailure()) FAIL() << "seed " << seed;
  }
  EXPECT_GT(zeros, 1000);
  EXPECT_GT(close, 1000);
}

/// What double can't tell: one smallest float beside coordinates up to the largest one.
TEST(Orientation, SeesTheSmallestFloatBesideTheLargest) {
  const std::array<Vec3, 4> lifted{{{0, 0, 0}, {kLargest, 0, 0}, {0, kLargest, 0}, {kLargest, kLargest, kSmallest}}};
  expect_consistent(lifted, 1);
  const std::array<Vec3, 4> spread{
      {{-kLargest, -kLargest, 0}, {kLargest, -kLargest, 0}, {-kLargest, kLargest, 0}, {1, 1, -kSmallest}}};
  expect_consistent(spread, -1);
  const std::array<Vec3, 4> tiny{{{0, 0, 0}, {kSmallest, 0, 0}, {0, kSmallest, 0}, {0, 0, kSmallest}}};
  expect_consistent(tiny, 1);
  EXPECT_EQ(orientation_along(2, {0, 0, 0}, {kLargest, kLargest, 0}, {1, 1, 0}), 0);
  EXPECT_EQ(orientation_along(2, {-kLargest, -kLargest, 0}, {kLargest, kLargest, 0}, {0, kSmallest, 0}), 1);
}

TEST(Orientation, OfEqualPointsIsNone) {
  const Vec3 a{1, 2, 3}, b{0.1F, 0.2F, 0.3F}, c{-7, 5, 1e-20F};
  expect_consistent({a, b, b, c}, 0);
  expect_consistent({a, a, a, a}, 0);
  EXPECT_EQ(orientation_along(0, a, b, b), 0);
}

/// Six times a tetrahedron's volume; beside floats of any size, down to what double can't hold beside them.
TEST(Orientation, KnowsVolumes) {
  EXPECT_EQ(tessera::volume({0, 0, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}), -1);
  EXPECT_EQ(tessera::volume({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, {1, 0, 0}), 1);
  EXPECT_EQ(tessera::volume({3, 5, 7}, {4, 5, 7}, {3, 8, 7}, {3, 5, 12}), 15);
  const float far = 0x1p60F, little = 0x1p-100F;
  EXPECT_EQ(tessera::volume({1, 1, little}, {-far, 0, 0}, {far, -far, 0}, {0, far, 0}), -0x1p20 * 3);
}

}  // namespace
}  // namespace tessera

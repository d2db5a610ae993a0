#include "core/light/spherical_triangle.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/random.h"
#include "tests/support/statistics.h"

namespace tessera {
namespace {

constexpr double kPi = std::numbers::pi;

using Corners = std::array<Vec3d, 3>;

/// By its sides (l'Huilier).
double solid_angle(const Corners& corners) {
  const auto side = [&](std::size_t i) {
    const Vec3d p = corners[(i + 1) % 3], q = corners[(i + 2) % 3];
    return std::atan2(length(cross(p, q)), dot(p, q));
  };
  const double a = side(0), b = side(1), c = side(2), s = (a + b + c) / 2;
  return 4 *
         std::atan(std::sqrt(std::tan(s / 2) * std::tan((s - a) / 2) * std::tan((s - b) / 2) * std::tan((s - c) / 2)));
}

bool holds(const Corners& corners, Vec3d direction) {
  const auto side = [&](std::size_t i) { return dot(cross(corners[i], corners[(i + 1) % 3]), direction); };
  return (side(0) > 0) == (side(1) > 0) && (side(1) > 0) == (side(2) > 0);
}

/// Of the plane pieces that its sides' middles make, the one that a direction falls into; 3 for the one in the middle.
std::array<Corners, 4> quarters(const Corners& c) {
  const Vec3d ab = (c[0] + c[1]) / 2, bc = (c[1] + c[2]) / 2, ca = (c[2] + c[0]) / 2;
  return {{{c[0], ab, ca}, {ab, c[1], bc}, {ca, bc, c[2]}, {ab, bc, ca}}};
}

const std::vector<Corners> kTriangles = {
    {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},              // an eighth of all directions
    {{{1, 0, 0}, {0, 0, 1}, {0, 1, 0}}},              // the same, wound the other way
    {{{-1, -1, 0.01}, {2, -1, 0.01}, {0, 2, 0.01}}},  // nearly a half
    {{{1, -1, 0.02}, {1, 3, 0.02}, {4, -1, 0.02}}},   // hardly above its plane, and beside it
    {{{-1, 0, .2}, {1, .1, .2}, {1, -.1, .2}}},       // a sliver
    {{{0.5, -4, 1}, {-0.5, -4, 1}, {0, 9, 1}}},       // a ribbon overhead
};

TEST(SphericalTriangle, KnowsItsSolidAngle) {
  const auto eighth = SphericalTriangle::seen({2, 0, 0}, {0, 3, 0}, {0, 0, 2});
  ASSERT_TRUE(eighth);
  EXPECT_NEAR(eighth->solid_angle(), kPi / 2, 1e-9);
  for (const Corners& c : kTriangles)
    for (std::size_t first = 0; first < 3; ++first) {
      const auto triangle = SphericalTriangle::seen(c[first], c[(first + 1) % 3], c[(first + 2) % 3]);
      ASSERT_TRUE(triangle) << solid_angle(c);
      EXPECT_NEAR(triangle->solid_angle() / solid_angle(c), 1, 1e-8);
    }
}

TEST(SphericalTriangle, ChoosesAllItsDirectionsAlike) {
  Random random(3);
  for (const Corners& c : kTriangles) {
    const auto triangle = SphericalTriangle::seen(c[0], c[1], c[2]);
    ASSERT_TRUE(triangle);
    const auto parts = quarters(c);
    std::array<double, 4> counts{}, expected{};
    constexpr int kSamples = 40'000;
    for (std::size_t i = 0; i < 4; ++i) expected[i] = kSamples * solid_angle(parts[i]) / solid_angle(c);
    for (int i = 0; i < kSamples; ++i) {
      const Vec3d direction = triangle->sample(
          {static_cast<float>(random.uniform(0, 1 - 0x1p-24)), static_cast<float>(random.uniform(0, 1 - 0x1p-24))});
      ASSERT_NEAR(length(direction), 1, 1e-6);
      for (std::size_t part = 0; part < 4; ++part) counts[part] += holds(parts[part], direction);
    }
    EXPECT_NEAR(counts[0] + counts[1] + counts[2] + counts[3], kSamples, 20) << "but for some on edges";
    EXPECT_GT(chi_square_test(counts, expected).p, 1e-4);
  }
}

TEST(SphericalTriangle, StaysFiniteAtTheEndsOfNumbers) {
  constexpr float kEnds[] = {0, 0x1p-24F, 0.5F, 1 - 0x1p-24F};
  for (const Corners& c : kTriangles) {
    const auto triangle = SphericalTriangle::seen(c[0], c[1], c[2]);
    ASSERT_TRUE(triangle);
    for (const float x : kEnds)
      for (const float y : kEnds) EXPECT_NEAR(length(triangle->sample({x, y})), 1, 1e-6) << x << ' ' << y;
  }
}

TEST(SphericalTriangle, IsNothingWhereItCanNotBeSampledWell) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kHuge = 1e18;
  EXPECT_FALSE(SphericalTriangle::seen({10, 0, 0}, {10, 1, 0}, {10, 0, 1})) << "small";
  EXPECT_FALSE(SphericalTriangle::seen({1, 0, 0}, {-1, 1, 0}, {-1, -1, 0})) << "in its plane";
  EXPECT_FALSE(SphericalTriangle::seen({1, 0, 1e-5}, {-1, 1, 1e-5}, {-1, -1, 1e-5})) << "all but in it";
  EXPECT_FALSE(SphericalTriangle::seen({1, 0, 1}, {1, 0, 1}, {0, 1, 1})) << "without area";
  EXPECT_FALSE(SphericalTriangle::seen({0, 0, 0}, {1, 0, 0}, {0, 1, 0})) << "at a corner";
  EXPECT_FALSE(SphericalTriangle::seen({kNaN, 0, 1}, {1, 0, 1}, {0, 1, 1}));
  const auto huge = SphericalTriangle::seen({kHuge, 0, 0}, {0, kHuge, 0}, {0, 0, kHuge});
  ASSERT_TRUE(huge);
  EXPECT_NEAR(huge->solid_angle(), kPi / 2, 1e-9);
}

}  // namespace
}  // namespace tessera

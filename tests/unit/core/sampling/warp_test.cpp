#include "core/sampling/warp.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <gtest/gtest.h>

#include "core/math/vec.h"
#include "core/math/vec2.h"
#include "tests/support/direction_test.h"
#include "tests/support/random.h"
#include "tests/support/statistics.h"

namespace tessera {
namespace {

/// The points of a grid's cells' centres, and of the square's edges.
template <class Check>
void for_points(Check check) {
  const int n = 64;
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= n; ++x)
      for (const float off : {0.0F, 0.5F})
        check({std::min((static_cast<float>(x) + off) / n, 0x1.fffffep-1F),
               std::min((static_cast<float>(y) + off) / n, 0x1.fffffep-1F)});
}

/// A map keeps areas in proportion when all of its cells have the same: |∂p/∂u × ∂p/∂v| = `area` everywhere, here by
/// differences.
template <class Map>
void expect_area(Map map, double area, double tolerance) {
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    const double h = 1e-3, x = random.uniform(2 * h, 1 - 2 * h), y = random.uniform(2 * h, 1 - 2 * h);
    // The concentric map has creases along the diagonals and Heitz's along one of them.
    if (std::abs(x - y) < 2 * h || std::abs(x + y - 1) < 2 * h) continue;
    const auto at = [&](double a, double b) { return map({static_cast<float>(a), static_cast<float>(b)}); };
    const Vec3d du = to_double(at(x + h, y)) - to_double(at(x - h, y));
    const Vec3d dv = to_double(at(x, y + h)) - to_double(at(x, y - h));
    EXPECT_NEAR(length(cross(du, dv)) / (4 * h * h), area, tolerance * area) << x << ' ' << y;
  }
}

TEST(Warp, DirectionsHaveLengthOne) {
  for_points([](Vec2 u) {
    EXPECT_NEAR(length(cosine_hemisphere(u)), 1, 2e-7);
    EXPECT_GE(cosine_hemisphere(u).z, 0);
    EXPECT_NEAR(length(uniform_sphere(u)), 1, 4e-7);
    for (const float narrow : {1.0F, 0.3F, 1e-3F, 1e-9F, 1e-30F}) {
      const Vec3 d = uniform_cone(u, narrow);
      EXPECT_NEAR(length(d), 1, 4e-7);
      EXPECT_GE(d.z, 1 - narrow - 1e-6F);
    }
    const Vec2 disk = uniform_disk(u);
    EXPECT_LE(std::hypot(disk.x, disk.y), 1 + 1e-7);
  });
}

TEST(Warp, AreasAreKept) {
  const double pi = std::numbers::pi;
  expect_area(
      [](Vec2 u) {
        const Vec2 d = uniform_disk(u);
        return Vec3{d.x, d.y, 0};
      },
      pi, 1e-2);
  expect_area(
      [](Vec2 u) {
        const Vec2 t = uniform_triangle(u);
        return Vec3{t.x, t.y, 0};
      },
      0.5, 1e-2);
  expect_area([](Vec2 u) { return uniform_cone(u, 0.25F); }, 1 / uniform_cone_pdf(0.25F), 1e-2);
  expect_area([](Vec2 u) { return uniform_cone(u, 1); }, 2 * pi, 1e-2);
  // Projected to the plane, the cosine's hemisphere is the disk.
  expect_area(
      [](Vec2 u) {
        const Vec3 d = cosine_hemisphere(u);
        return Vec3{d.x, d.y, 0};
      },
      pi, 1e-2);
}

/// Archimedes: the height of a uniform direction is uniform, and so is its azimuth.
TEST(Warp, SphereIsUniform) {
  const int n = 256;
  double height = 0, square = 0, fourth = 0, across = 0;
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const Vec3 d = uniform_sphere({(static_cast<float>(x) + 0.5F) / n, (static_cast<float>(y) + 0.5F) / n});
      height += d.z;
      square += double{d.z} * d.z;
      fourth += std::pow(double{d.z}, 4);
      across += double{d.x} * d.x;
    }
  EXPECT_NEAR(height / n / n, 0, 1e-4);
  EXPECT_NEAR(square / n / n, 1.0 / 3, 1e-4);
  EXPECT_NEAR(fourth / n / n, 1.0 / 5, 1e-4);
  EXPECT_NEAR(across / n / n, 1.0 / 3, 1e-4);
}

TEST(Warp, ANarrowConeKeepsItsShape) {
  // Half a degree's disk of the sun: sin² of the angle is uniform up to sin² α.
  const double angle = 0.0046, one_minus_cos = 2 * std::pow(std::sin(angle / 2), 2);
  double sum = 0;
  const int n = 128;
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const Vec3 d = uniform_cone({(static_cast<float>(x) + 0.5F) / n, (static_cast<float>(y) + 0.5F) / n},
                                  static_cast<float>(one_minus_cos));
      sum += std::pow(std::hypot(double{d.x}, double{d.y}) / std::sin(angle), 2);
    }
  EXPECT_NEAR(sum / n / n, 0.5, 1e-3);
}

TEST(Warp, TriangleIsCovered) {
  for_points([](Vec2 u) {
    const Vec2 b = uniform_triangle(u);
    EXPECT_GE(b.x, 0);
    EXPECT_GE(b.y, 0);
    EXPECT_LE(double{b.x} + b.y, 1);
  });
}

TEST(Warp, DirectionsHaveTheirDensity) {
  const int count = 1'000'000;
  Random random(11);
  const auto u = [&] {
    return Vec2{static_cast<float>(random.uniform(0, 1)), static_cast<float>(random.uniform(0, 1))};
  };
  const auto expect_fit = [&](auto warp, auto density) {
    const DirectionTest test = test_directions([&](int) { return std::optional(warp(u())); }, density, count);
    EXPECT_NEAR(test.integral, 1, 1e-4);
    EXPECT_GT(test.fit.p, sidak(0.01, 4));
  };
  expect_fit(cosine_hemisphere, [](Vec3 d) { return cosine_hemisphere_pdf(d.z); });
  expect_fit(uniform_sphere, [](Vec3) { return kUniformSpherePdf; });
  expect_fit([](Vec2 v) { return uniform_cone(v, 0.25F); },
             [](Vec3 d) { return d.z >= 0.75F ? uniform_cone_pdf(0.25F) : 0; });
  // What is drawn otherwise than claimed is seen.
  EXPECT_LT(test_directions([&](int) { return std::optional(cosine_hemisphere(u())); },
                            [](Vec3 d) { return d.z > 0 ? 2 * kUniformSpherePdf : 0; }, count)
                .fit.p,
            1e-6);
}

TEST(Warp, BasesAreOrthonormalAndRightHanded) {
  for (int i = 0; i < 20'000; ++i) {
    Random random(i);
    Vec3d n = random.direction();
    if (i % 4 == 0) n.z *= random.magnitude(-9, 0);  // the crease
    if (i % 4 == 1) n = {n.x * 1e-6, n.y * 1e-6, n.z < 0 ? -1.0 : 1.0};
    const Vec3 z = to_float(n / length(n));
    const Basis basis = basis_around(z);
    const double tolerance = 5e-7;
    EXPECT_NEAR(dot(basis.x, basis.y), 0, tolerance) << i;
    EXPECT_NEAR(dot(basis.x, z), 0, tolerance) << i;
    EXPECT_NEAR(dot(basis.y, z), 0, tolerance) << i;
    EXPECT_NEAR(length(basis.x), 1, tolerance) << i;
    EXPECT_NEAR(length(basis.y), 1, tolerance) << i;
    EXPECT_NEAR(dot(cross(basis.x, basis.y), z), 1, tolerance) << i;
    const Vec3 v = to_float(random.direction());
    EXPECT_NEAR(length(basis.to_world(basis.to_local(v)) - v), 0, 2 * tolerance) << i;
  }
  for (const Vec3 axis : {Vec3{0, 0, 1}, Vec3{0, 0, -1}, Vec3{0, 1, -0.0F}, Vec3{1, 0, 0}})
    EXPECT_EQ(basis_around(axis).to_world({0, 0, 1}), axis);
}

}  // namespace
}  // namespace tessera

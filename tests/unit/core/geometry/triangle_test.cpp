#include "core/geometry/triangle.h"

#include <gtest/gtest.h>

#include "core/geometry/triangle_mesh.h"
#include "tests/support/random.h"

namespace tessera {
namespace {

constexpr Vec3 kA{0, 0, 0}, kB{1, 0, 0}, kC{0, 1, 0};

std::optional<float> hit(const Ray& ray, Vec3 a = kA, Vec3 b = kB, Vec3 c = kC) {
  return intersect_triangle(TriangleRay(ray), a, b, c);
}

TEST(Triangle, IsHitInsideOnEdgesAndCornersFromBothSides) {
  for (const float side : {2.0F, -2.0F})
    for (const Vec3 p : {Vec3{0.25F, 0.25F, 0}, Vec3{0.5F, 0, 0}, Vec3{0, 0.5F, 0}, Vec3{0.5F, 0.5F, 0}, kA, kB, kC})
      EXPECT_EQ(hit({p + Vec3{0, 0, side}, {0, 0, -side}}), 1.0F) << p.x << " " << p.y;
  EXPECT_FALSE(hit({{0.5F, 0.5000001F, 1}, {0, 0, -1}}));
  EXPECT_FALSE(hit({{-1e-30F, 0.5F, 1}, {0, 0, -1}})) << "just outside, however little";
}

TEST(Triangle, IsMissedEdgeOnBehindAndBeyond) {
  EXPECT_FALSE(hit({{-1, 0.2F, 0}, {1, 0, 0}})) << "in its plane";
  EXPECT_FALSE(hit({{0.2F, 0.2F, 1}, {0, 0, 1}})) << "behind the origin";
  EXPECT_FALSE(hit({{0.2F, 0.2F, 0}, {0, 0, 1}})) << "t = 0 is outside the open interval";
  EXPECT_FALSE(hit({{0.2F, 0.2F, 1}, {0, 0, -1}, 0, 0.5F}));
}

TEST(Triangle, WithoutAreaIsNeverHit_Stress16_Stress17) {
  EXPECT_FALSE(hit({{0.5F, 0, 1}, {0, 0, -1}}, kA, kB, {2, 0, 0}));
  EXPECT_FALSE(hit({{0, 0, 1}, {0, 0, -1}}, kA, kA, kB));
  EXPECT_FALSE(hit({{0, 0, 1}, {0, 0, -1}}, kA, kA, kA));
}

/// Far smaller than what doubles tell apart where the ray passes: missed all the same.
TEST(Triangle, IsMissedByRaysFarBesideIt_Stress18) {
  for (const int exponent : {20, 50, 51, 52, 53, 100}) {
    const float s = std::ldexp(1.0F, -exponent);
    Random random(18);
    for (int i = 0; i < 20'000; ++i) {
      const Vec3 origin = to_float(random.in_cube() * 10), target = to_float(random.in_cube() * 10);
      ASSERT_FALSE(hit({origin, target - origin}, {s, s, s}, {2 * s, s, s}, {s, 2 * s, s})) << exponent << " " << i;
    }
  }
}

TEST(Triangle, IsMissedByRaysWithNan_Stress07) {
  const float nan = std::nanf("");
  for (int axis = 0; axis < 3; ++axis) {
    Ray ray{{0.2F, 0.2F, 1}, {0, 0, -1}};
    ray.origin[axis] = nan;
    EXPECT_FALSE(hit(ray));
    ray = {{0.2F, 0.2F, 1}, {0, 0, -1}};
    ray.direction[axis] = nan;
    EXPECT_FALSE(hit(ray));
  }
  EXPECT_FALSE(hit({{0.2F, 0.2F, 1}, {0, 0, 0}}));
}

/// Möller & Trumbore 1997 in long double: another route to the same number.
long double t_in_long_double(const Ray& ray, Vec3 a, Vec3 b, Vec3 c) {
  using Wide = Vec<long double>;
  const auto wide = [](Vec3 v) { return Wide{v.x, v.y, v.z}; };
  const Wide e1 = wide(b) - wide(a), e2 = wide(c) - wide(a), d = wide(ray.direction), s = wide(ray.origin) - wide(a);
  const Wide q = cross(s, e1);
  return dot(e2, q) / dot(e1, cross(d, e2));
}

TEST(Triangle, KnowsTToOneRounding_Stress06_Stress15) {
  Random random(5);
  int hits = 0;
  for (int i = 0; i < 200'000; ++i) {
    const double scale = random.magnitude(-6, 6);
    const Vec3 a = to_float(random.in_cube() * scale), b = to_float(random.in_cube() * scale);
    // Every third one a needle of aspect 10^7.
    const Vec3 c =
        i % 3 == 0 ? to_float(to_double(b) + random.in_cube() * (scale * 1e-7)) : to_float(random.in_cube() * scale);
    const Vec3 inside = to_float((to_double(a) + to_double(b) + to_double(c)) / 3.0);
    const Vec3 origin = to_float(random.in_cube() * (scale * 5));
    const Ray ray{origin, to_float(to_double(inside - origin) * random.magnitude(-15, 15))};
    const auto t = hit(ray, a, b, c);
    if (!t) continue;  // the float ray to a needle's middle may pass beside it
    ++hits;
    const long double exact = t_in_long_double(ray, a, b, c);
    const Vec3d ab = to_double(b) - to_double(a), ac = to_double(c) - to_double(a), bc = ac - ab,
                d = to_double(ray.direction);
    const Vec3d normal = cross(ab, ac);
    const double longest = std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)});
    // One float rounding of t, and double's share: that grows as the ray grazes the plane and with the aspect of the
    // triangle, whose shortest edge function is a small difference of large products.
    const double graze = length(normal) * length(d) / std::abs(dot(normal, d)), aspect = longest / length(normal);
    const double way = (length(to_double(origin)) + scale) / length(d);
    EXPECT_LE(std::abs(static_cast<double>(*t - exact)),
              std::abs(static_cast<double>(exact)) * 0x1p-24 * 1.001 + way * 0x1p-48 * graze * aspect)
        << "seed " << i;
  }
  EXPECT_GT(hits, 130'000);
}

TEST(Triangle, IsHitTheSameAtEveryScale_Stress18_Stress20) {
  const Vec3 a{-1, -0.5F, 0}, b{1.25F, -0.75F, 0.5F}, c{0.1F, 1, -0.25F};
  Random random(9);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 origin = to_float(random.in_cube() * 3) + Vec3{0, 0, 3};
    const Vec3 target = to_float(random.in_cube());
    const bool expected = hit({origin, target - origin}, a, b, c).has_value();
    for (const int exponent : {-50, -30, 30, 50}) {  // powers of two: every difference scales exactly
      const float s = std::ldexp(1.0F, exponent);
      EXPECT_EQ(hit({origin * s, (target - origin) * s}, a * s, b * s, c * s).has_value(), expected)
          << i << " " << exponent;
    }
  }
}

TEST(Triangle, SurfaceInterpolatesNormalsAndKeepsTheFace) {
  const Vec3 corners[3] = {kA, kB, kC};
  const Vec3 normals[3] = {{0, 0, 2}, {0, 2, 0}, {0, 0, 2}};
  const Ray ray{{0.5F, 0, 3}, {0, 0, -1}};
  const SurfacePoint smooth = triangle_surface(TriangleRay(ray), corners, normals);
  EXPECT_EQ(smooth.geometric_normal, (Vec3d{0, 0, 1}));
  EXPECT_NEAR(smooth.shading_normal.y, std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(smooth.shading_normal.z, std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(smooth.position.x, 0.5, 1e-15);
  EXPECT_EQ(triangle_surface(TriangleRay(ray), corners, nullptr).shading_normal, (Vec3d{0, 0, 1}));

  const Vec3 inward[3] = {{0, 0, -2}, {0, -2, 0}, {0, 0, -2}};
  EXPECT_EQ(triangle_surface(TriangleRay(ray), corners, inward).shading_normal, smooth.shading_normal)
      << "normals against the winding are turned to its side";
}

TEST(Triangle, ToTheSmoothSurfaceAndNeverInward) {
  const Vec3 corners[3] = {kA, kB, kC};
  const Ray down{{0.5F, 0.25F, 3}, {0, 0, -1}}, up{{0.5F, 0.25F, -3}, {0, 0, 1}};
  const Vec3 bulging[3] = {{-1, -1, 2}, {1, 0, 1}, {0, 3, 3}};
  // Corner by corner the way to its tangent plane, times its share, as Hanika has it; dot(P − V, n) / |n|² · n.
  // A: −0.75/6·(−1, −1, 2)·¼; B: −0.5/2·(1, 0, 1)·½; C: −0.75·3/18·(0, 3, 3)·¼, each the other way.
  const Vec3d expected =
      Vec3d{-1, -1, 2} * (0.75 / 6 / 4) + Vec3d{1, 0, 1} * (0.5 / 2 / 2) + Vec3d{0, 3, 3} * (2.25 / 18 / 4);
  const SurfacePoint from_above = triangle_surface(TriangleRay(down), corners, bulging);
  EXPECT_LT(length(from_above.to_smooth - expected), 1e-15);
  EXPECT_EQ(triangle_surface(TriangleRay(up), corners, bulging).to_smooth, Vec3d{}) << "hollow from below";

  const Vec3 against[3] = {-bulging[0], -bulging[1], -bulging[2]};
  EXPECT_EQ(triangle_surface(TriangleRay(down), corners, against).to_smooth, from_above.to_smooth);
  const Vec3 hollow[3] = {{1, 1, 2}, {-1, 0, 1}, {0, -3, 3}};
  EXPECT_EQ(triangle_surface(TriangleRay(down), corners, hollow).to_smooth, Vec3d{});
  EXPECT_GT(triangle_surface(TriangleRay(up), corners, hollow).to_smooth.z * -1, 0.05) << "bulging from below";
  const Vec3 useless[3] = {{}, {1, 0, -1}, {0, 0, 3}};
  EXPECT_EQ(triangle_surface(TriangleRay(down), corners, useless).to_smooth, Vec3d{}) << "none, away, and flat";
}

/// On a level floor nothing is uncertain about the height, however large the floor.
TEST(Triangle, IsKnownAxisByAxis) {
  const Vec3 corners[3] = {{-1e12F, 3, -2e12F}, {1e12F, 3, -2e12F}, {0, 3, 4e12F}};
  const SurfacePoint at = triangle_surface(TriangleRay({{1, 9, 2}, {0.25F, -1, 0.125F}}), corners, nullptr);
  EXPECT_NEAR(at.error.y / 3, 0x1p-48, 0x1p-60);
  EXPECT_NEAR(at.error.x / 1e12, 0x1p-48, 0x1p-58);
  EXPECT_LE(std::abs(at.position.y - 3), at.error.y);
  EXPECT_NEAR(at.position.x, 2.5, 1e-2);
  EXPECT_NEAR(at.position.z, 2.75, 1e-2);
}

/// However near the plane a ray starts, it starts on its right side.
TEST(Triangle, IsMissedByWhatLeavesItAndHitByWhatComes_Stress24) {
  Random random(24);
  for (int i = 0; i < 20'000; ++i) {
    const auto size = static_cast<float>(random.magnitude(0, 15));
    const Vec3 a{-size, 0, -size}, b{size, 0, -size}, c{0, 0, size};
    const float height = std::ldexp(1.0F, -static_cast<int>(random.bits() % 149));
    const Vec3 from{static_cast<float>(random.uniform(-0.1, 0.1)) * size, height, 0};
    const Vec3 way = to_float(Vec3d{random.uniform(-1, 1), random.magnitude(-3, 0), random.uniform(-1, 1)});
    ASSERT_FALSE(hit({from, way}, a, b, c)) << i;
    const Vec3 back = -way;
    const double t = double{height} / way.y;
    if (t < 1e-37 || std::abs(t * way.x) > 0.1 * size || std::abs(t * way.z) > 0.1 * size) continue;
    const auto met = hit({from, back}, a, b, c);
    ASSERT_TRUE(met) << i;
    ASSERT_NEAR(*met / t, 1, 1e-2) << i;
  }
}

TEST(TriangleMesh, DropsAndCountsWhatCannotBeHit_Stress27) {
  TriangleMesh mesh;
  const float nan = std::nanf("");
  mesh.positions = {kA, kB, kC, {nan, 0, 0}, {kInfinity, 0, 0}, {1.9e18F, 0, 0}, kA};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {0, 1, 5}, {0, 0, 1}, {0, 6, 1}};
  const DroppedTriangles dropped = drop_unusable_triangles(mesh);
  EXPECT_EQ(dropped.not_finite, 3U);
  EXPECT_EQ(dropped.degenerate, 2U);
  EXPECT_EQ(mesh.triangles, (std::vector<TriangleIndices>{{0, 1, 2}}));
}

}  // namespace
}  // namespace tessera

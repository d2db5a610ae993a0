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

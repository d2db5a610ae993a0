#include <gtest/gtest.h>

#include "tests/property/quadric_cases.h"
#include "tests/support/quadric_oracle.h"

namespace tessera {
namespace {

constexpr int kCases = 150'000;
constexpr Wide kDouble = 0x1p-53L;

template <typename Primitive>
class QuadricOracle : public testing::Test {};
using Primitives = testing::Types<Sphere, Cone, Cylinder, Disk>;
TYPED_TEST_SUITE(QuadricOracle, Primitives);

/// Hit or miss as in wider precision outside a band of 64·ε·M around silhouettes and rims (the solvers know the
/// ray to a few ε·M), and t to 2 ulp plus that band seen at the angle of incidence.
TYPED_TEST(QuadricOracle, Stress28_HitsAndDistancesAgreeWithWiderPrecision) {
  int hits = 0, misses = 0, undecided = 0;
  for (int seed = 0; seed < kCases; ++seed) {
    Random random(seed);
    const auto primitive = make<TypeParam>(random);
    const Aabb box = bounds(primitive);
    if (max_component(abs(box.diagonal())) == 0) continue;
    const Ray ray = make_ray(random, box);
    const Crossings exact = crossings(primitive, ray);
    const Wide m = reach(box, ray), band = 64 * kDouble * m;
    const Wide scale = std::sqrt(dot(widen(ray.direction), widen(ray.direction)));
    if (exact.margin < band) {
      ++undecided;
      continue;
    }
    const auto first = std::ranges::find_if(exact.all, [](const ExactCrossing& c) { return c.t > 0; });
    const auto t = intersect(primitive, ray);
    if (first == exact.all.end()) {
      ++misses;
      EXPECT_FALSE(t) << "seed " << seed;
      continue;
    }
    ++hits;
    ASSERT_TRUE(t) << "seed " << seed << " should hit at " << first->t << " margin " << exact.margin / m;
    EXPECT_LE(std::abs(*t - first->t), 2 * ulp(first->t) + band / (first->steepness * scale)) << "seed " << seed;
  }
  EXPECT_GT(hits, kCases / 20);
  EXPECT_GT(misses, kCases / 50);
  EXPECT_LT(undecided, kCases / 10);
}

/// Scaling a direction by a power of two changes no digit of the double computation.
TYPED_TEST(QuadricOracle, Stress06_UnnormalisedDirectionsScaleT) {
  for (int seed = 0; seed < kCases / 5; ++seed) {
    Random random(seed);
    const auto primitive = make<TypeParam>(random);
    Ray ray = make_ray(random, bounds(primitive));
    const Vec3d d = to_double(ray.direction);
    ray.direction = to_float(d / length(d));
    const auto t = intersect(primitive, ray);
    for (const int power : {-66, -20, -1, 3, 30, 66}) {
      const float factor = std::ldexp(1.0F, power);
      const auto scaled = intersect(primitive, {ray.origin, ray.direction * factor});
      ASSERT_EQ(scaled.has_value(), t.has_value()) << "seed " << seed << " 2^" << power;
      if (t) {
        EXPECT_EQ(*scaled * factor, *t) << "seed " << seed << " 2^" << power;
      }
    }
  }
}

/// The double root that `surface` finds again lies on the surface to its own error bound; unit normals look outward.
TYPED_TEST(QuadricOracle, SurfacePointsLieOnTheSurface) {
  for (int seed = 0; seed < kCases; ++seed) {
    Random random(seed);
    const auto primitive = make<TypeParam>(random);
    const Aabb box = bounds(primitive);
    const Ray ray = make_ray(random, box);
    const auto t = intersect(primitive, ray);
    if (!t) continue;
    const Wide size = length(to_double(box.diagonal()));
    const SurfacePoint at = surface(primitive, ray, *t);
    EXPECT_LE(distance(primitive, widen(at.position)), max_component(at.error)) << "seed " << seed;
    const Vec3w turned = widen(at.geometric_normal) - outward_normal(primitive, widen(at.position));
    const Wide leeway = 1e-12L + 2 * length(at.error) * curvature(primitive, widen(at.position));
    EXPECT_LE(std::sqrt(dot(turned, turned)), leeway) << "seed " << seed;
    EXPECT_EQ(at.geometric_normal, at.shading_normal) << "seed " << seed;
    // On the ray's line as double knows it, whatever the rounding of t; beside a tip the surface is steep in the ray.
    const Vec3w d = unit(widen(ray.direction)), from_origin = widen(at.position) - widen(ray.origin);
    const Vec3w beside = from_origin - dot(from_origin, d) * d;
    if (curvature(primitive, widen(at.position)) * size < 1e3L) {
      EXPECT_LE(std::sqrt(dot(beside, beside)), 1e-10L * reach(box, ray)) << "seed " << seed;
    }
    // Not farther from where the ray says it is than t's rounding and a grazing angle's leeway.
    const Vec3w off = widen(at.position) - point_at(ray, *t);
    EXPECT_LE(max_component(abs(off)), 2 * kUnitRoundoff * reach(box, ray)) << "seed " << seed;
  }
}

}  // namespace
}  // namespace tessera

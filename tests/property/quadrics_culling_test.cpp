#include <gtest/gtest.h>

#include "tests/property/quadric_cases.h"
#include "tests/property/quadric_surface.h"
#include "tests/support/quadric_oracle.h"

namespace tessera {
namespace {

constexpr int kCases = 150'000;

template <typename Primitive>
class QuadricCulling : public testing::Test {};
using Primitives = testing::Types<Sphere, Cone, Cylinder, Disk>;
TYPED_TEST_SUITE(QuadricCulling, Primitives);

/// What core/geometry/double_root.h promises to culling, and a little more, since core/bounds/cull_ray.h counts on
/// u·M inside the bounds: the rounding of t and nothing to speak of beside it.
template <typename Primitive>
void expect_hit_within_pad(const Primitive& primitive, const Ray& ray, int seed) {
  const auto t = intersect(primitive, ray);
  if (!t) return;
  const Aabb box = bounds(primitive);
  const Wide m = reach(box, ray), u = kUnitRoundoff;
  const Vec3w p = point_at(ray, *t);
  EXPECT_LE(distance(primitive, p), 4 * u * m) << "seed " << seed << " t " << *t;
  EXPECT_LE(outside(box, p), 1.001L * u * m) << "seed " << seed << " t " << *t;
}

/// The first hit, and the next one beyond it.
template <typename Primitive>
void expect_hits_within_pad(const Primitive& primitive, const Ray& ray, int seed) {
  expect_hit_within_pad(primitive, ray, seed);
  Ray rest = ray;
  rest.t_min = intersect(primitive, ray).value_or(kInfinity);
  expect_hit_within_pad(primitive, rest, seed);
}

TYPED_TEST(QuadricCulling, HitsStayWithinThePad) {
  for (int seed = 0; seed < kCases; ++seed) {
    Random random(seed);
    const auto primitive = make<TypeParam>(random);
    expect_hits_within_pad(primitive, make_ray(random, bounds(primitive)), seed);
  }
}

/// Awkward lines, half of them turned by 1e-12 … 1e-1 and shifted by 1e-14 … 1 sizes.
TYPED_TEST(QuadricCulling, HitsOfNearlyDegenerateRaysStayWithinThePad) {
  int hits = 0;
  for (int seed = 0; seed < kCases; ++seed) {
    Random random(seed);
    const auto primitive = make<TypeParam>(random);
    const double size = length(to_double(bounds(primitive).diagonal()));
    auto [point, direction] = awkward_line(primitive, random);
    if (length(direction) == 0) continue;
    direction = direction / length(direction);
    if (random.bits() % 2) direction = direction + random.magnitude(-12, -1) * random.in_cube();
    if (random.bits() % 2) point = point + (size * random.magnitude(-14, 0)) * random.in_cube();
    const Ray ray{to_float(point - size * random.magnitude(-3, 4) * direction), to_float(direction)};
    hits += intersect(primitive, ray).has_value();
    expect_hits_within_pad(primitive, ray, seed);
  }
  EXPECT_GT(hits, kCases / 20);
}

/// A box holds the whole surface.
TYPED_TEST(QuadricCulling, BoundsHoldTheSurface) {
  for (int seed = 0; seed < kCases; ++seed) {
    Random random(seed);
    const auto primitive = make<TypeParam>(random);
    const Aabb box = bounds(primitive);
    const Vec3w p = point_on(primitive, random);
    EXPECT_LE(outside(box, p), 0) << "seed " << seed;
  }
}

}  // namespace
}  // namespace tessera

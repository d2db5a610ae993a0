#include <gtest/gtest.h>

#include "tests/property/quadric_cases.h"
#include "tests/property/quadric_oracle.h"

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

/// A random point of the surface, in wider precision; extremes along the axes as often as not.
Vec3w extreme_or_random(Random& random) {
  if (random.bits() % 2) return unit(widen(random.direction()));
  Vec3w v;
  v[static_cast<int>(random.bits() % 3)] = random.bits() % 2 ? 1 : -1;
  return v;
}

Vec3w point_on(const Sphere& sphere, Random& random) {
  return widen(sphere.center) + static_cast<Wide>(sphere.radius) * extreme_or_random(random);
}

/// The point of the circle across `axis` that reaches farthest along `toward`.
Vec3w on_circle(Vec3w axis, Vec3w toward) {
  const Vec3w n = unit(axis);
  const Vec3w across = toward - dot(toward, n) * n;
  return dot(across, across) > 1e-24L ? unit(across) : unit(cross(n, std::abs(n.x) < 0.7L ? Vec3w{1} : Vec3w{0, 1}));
}

Vec3w point_on(const Disk& disk, Random& random) {
  return widen(disk.center) + static_cast<Wide>(disk.radius) * on_circle(widen(disk.normal), extreme_or_random(random));
}

Vec3w point_on(const Cone& cone, Random& random) {
  const Wide mix = random.bits() % 2 ? random.uniform(0, 1) : static_cast<double>(random.bits() % 2);
  const Vec3w axis = widen(cone.apex) - widen(cone.base);
  const Wide radius = cone.base_radius + mix * (static_cast<Wide>(cone.apex_radius) - cone.base_radius);
  return widen(cone.base) + mix * axis + radius * on_circle(axis, extreme_or_random(random));
}

Vec3w point_on(const Cylinder& c, Random& random) { return point_on(Cone{c.base, c.radius, c.apex, c.radius}, random); }

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

#include <gtest/gtest.h>

#include "core/geometry/cone.h"
#include "core/geometry/cylinder.h"
#include "core/geometry/disk.h"
#include "core/geometry/sphere.h"
#include "core/integrator/spawn.h"
#include "tests/support/random.h"

namespace tessera {
namespace {

constexpr int kPrimitives = 1000;
constexpr int kSpawned = 1000;

/// Radii 1e-4 … 1e4, up to 1e8 away from the origin.
float some_radius(Random& random) { return static_cast<float>(random.magnitude(-4, 4)); }
Vec3 some_center(Random& random) { return to_float(random.magnitude(-8, 8) * random.in_cube()); }

template <typename Primitive>
Primitive make(Random& random);
template <>
Sphere make(Random& random) {
  return {some_center(random), some_radius(random)};
}
template <>
Disk make(Random& random) {
  return {some_center(random), *UnitVec3::normalize(random.direction()), some_radius(random)};
}
template <>
Cone make(Random& random) {
  const float r = some_radius(random), narrower = static_cast<float>(random.uniform(0, r));
  const Vec3 base = some_center(random);
  Vec3 apex = base;
  for (double l = r; apex == base; l *= 2) apex = to_float(to_double(base) + l * random.direction());
  return {base, r, apex, random.bits() % 2 ? 0 : narrower};
}
template <>
Cylinder make(Random& random) {
  const Cone cone = make<Cone>(random);
  return {cone.base, cone.apex, cone.base_radius};
}

template <typename Primitive>
class QuadricRespawn : public testing::Test {};
using Primitives = testing::Types<Sphere, Cone, Cylinder, Disk>;
TYPED_TEST_SUITE(QuadricRespawn, Primitives);

/// All four are convex: what leaves on the outer side, as a ray or as a segment, never comes back. (A disk has two
/// outer sides.)
TYPED_TEST(QuadricRespawn, Stress24_NothingThatLeavesHitsAgain) {
  std::uint64_t spawned = 0;
  for (int seed = 0; seed < kPrimitives; ++seed) {
    Random random(seed);
    const auto primitive = make<TypeParam>(random);
    const Aabb box = bounds(primitive);
    const Vec3d middle = 0.5 * (to_double(box.lo) + to_double(box.hi)), half = to_double(box.hi) - middle;
    for (int i = 0; i < kSpawned; ++i) {
      const Vec3d offset = random.in_cube();
      const Vec3d target = middle + Vec3d{offset.x * half.x, offset.y * half.y, offset.z * half.z};
      const Vec3 origin = to_float(target + (length(half) * random.magnitude(-1, 3)) * random.direction());
      const Ray ray{origin, to_float(target - to_double(origin))};
      const auto t = intersect(primitive, ray);
      if (!t) continue;
      ++spawned;
      const SurfacePoint at = surface(primitive, ray, *t);
      Vec3d out = random.direction();
      if (random.bits() % 4 == 0) out = cross(out, at.geometric_normal) + 1e-9 * out;  // grazing
      out = to_double(to_float(out));                                                  // as the spawned ray has it
      const double side = dot(out, at.geometric_normal);
      if (side == 0) continue;
      if (side < 0 && !std::is_same_v<TypeParam, Disk>) out = -out;
      const Vec3 from = spawn_origin(at, out);
      ASSERT_EQ(intersect(primitive, {from, to_float(out)}), std::nullopt) << "seed " << seed << " ray " << i;
      const int power = std::ilogb(length(half) * random.magnitude(-2, 6));
      const Vec3 to_light = to_float(out) * std::ldexp(1.0F, power);
      ASSERT_EQ(intersect(primitive, {from, to_light, 0, 1}), std::nullopt) << "seed " << seed << " segment " << i;
    }
  }
  EXPECT_GT(spawned, std::uint64_t{kPrimitives} * kSpawned / 20);
}

/// What goes inside meets the far side, not the spot that it left.
TEST(QuadricRespawnInside, Stress31_RaysIntoASphereMeetItsFarSide) {
  for (int seed = 0; seed < kPrimitives * 100; ++seed) {
    Random random(seed);
    const Sphere sphere{to_float(random.magnitude(-3, 3) * random.in_cube()),
                        static_cast<float>(random.magnitude(-2, 3))};
    const Vec3d n = random.direction();
    const Ray ray{to_float(to_double(sphere.center) + (3.0 * sphere.radius) * n), to_float(-n)};
    const auto t = intersect(sphere, ray);
    ASSERT_TRUE(t) << "seed " << seed;
    const SurfacePoint at = surface(sphere, ray, *t);
    Vec3d in = random.direction();
    if (dot(in, at.geometric_normal) > 0) in = -in;
    const double cosine = -dot(in, at.geometric_normal), chord = 2 * sphere.radius * cosine;
    const Vec3 from = spawn_origin(at, in);
    const double off = length(to_double(from) - at.position);
    if (off > 1e-3 * chord * cosine) continue;  // a chord too short for that float origin
    const auto far = intersect(sphere, {from, to_float(in)});
    ASSERT_TRUE(far) << "seed " << seed;
    EXPECT_NEAR(*far, chord, 2e-3 * chord) << "seed " << seed;
  }
}

/// The ground of a thousand-kilometre sphere seen from a metre above: lit everywhere, and the horizon where it
/// belongs, sqrt(2·h/r) below level.
TEST(QuadricRespawnInside, Stress29_AGroundSphereHasNoAcne) {
  constexpr Sphere kGround{{0, -1e6F, 0}, 1e6F};
  constexpr int kRows = 1024;
  const double pixel = 2 * std::tan(0.5) / kRows;  // 1 radian from top to bottom
  const double horizon = -std::sqrt(2 * 1 / 1e6) / pixel;
  for (const double sideways : {-0.7, 0.0, 0.3}) {
    for (int row = -kRows / 2; row < kRows / 2; ++row) {
      const double up = (row + 0.5) * pixel, level = std::hypot(1, sideways);
      const Ray ray{{0, 1, 0}, to_float(Vec3d{sideways, up * level, -1})};
      const auto t = intersect(kGround, ray);
      if (std::abs(row + 0.5 - horizon) > 1) {
        EXPECT_EQ(t.has_value(), row + 0.5 < horizon) << "row " << row;
      }
      if (!t) continue;
      const SurfacePoint at = surface(kGround, ray, *t);
      EXPECT_GT(at.geometric_normal.y, 0.99);
      for (const Vec3d toward_light : {Vec3d{0, 1, 0}, Vec3d{1, 0.05, 0}, Vec3d{-3, 4, 5}})
        EXPECT_FALSE(intersect(kGround, {spawn_origin(at, toward_light), to_float(toward_light)})) << "row " << row;
    }
  }
}

}  // namespace
}  // namespace tessera

#include "core/bounds/cull_ray.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

bool enters(const Ray& ray, const Aabb& box) { return !CullRay(ray, box).misses(box, ray.t_min, ray.t_max); }

TEST(CullRay, TakesPlusAndMinusZeroAlike_Stress01) {
  const Aabb box{{-1, -1, -1}, {1, 1, 1}};
  for (int signs = 0; signs < 8; ++signs)
    for (int used = 1; used < 8; ++used) {
      Ray ray{{0, 0, 0}, {}};
      for (int axis = 0; axis < 3; ++axis) {
        const float sign = signs >> axis & 1 ? -1.0F : 1.0F;
        ray.direction[axis] = sign * (used >> axis & 1 ? 1.0F : 0.0F);
        if (used >> axis & 1) ray.origin[axis] = -3 * sign;
      }
      EXPECT_TRUE(enters(ray, box)) << signs << " " << used;
      for (int axis = 0; axis < 3; ++axis)
        if (!(used >> axis & 1)) {
          Ray beside = ray;
          beside.origin[axis] = 2;
          EXPECT_FALSE(enters(beside, box)) << signs << " " << used << " " << axis;
        }
    }
}

TEST(CullRay, HitsTheClosedBoxFromItsOwnPlanes_Stress02_Stress03) {
  const Aabb box{{0, 0, 0}, {1, 1, 1}};
  EXPECT_TRUE(enters({{0, 0.5F, -1}, {0, 0, 1}}, box)) << "in a face";
  EXPECT_TRUE(enters({{1, 1, -1}, {0, 0, 1}}, box)) << "along an edge";
  EXPECT_TRUE(enters({{-1, -1, -1}, {1, 1, 1}}, box)) << "through two corners";
  EXPECT_TRUE(enters({{0, 0, 0}, {-1, 0, 0}}, box)) << "leaving from a corner";
}

TEST(CullRay, NeverMissesAPointInABoxOfNoThickness_Stress04) {
  Random random(4);
  for (int i = 0; i < 1'000'000; ++i) {
    const int flat = i % 3;
    Vec3 lo = to_float(random.in_cube()), hi = to_float(random.in_cube());
    Aabb box{min(lo, hi), max(lo, hi)};
    box.hi[flat] = box.lo[flat];
    const Vec3 origin = to_float(random.in_cube() * 10);
    // The nearest float ray to a point of the box: its line misses the point by roundings of the direction alone.
    Vec3 target;
    for (int axis = 0; axis < 3; ++axis)
      target[axis] = box.lo[axis] + static_cast<float>(random.uniform(0.05, 0.95)) * (box.hi[axis] - box.lo[axis]);
    if (origin == target) continue;
    ASSERT_TRUE(enters({origin, target - origin}, box)) << "seed " << i;
  }
}

TEST(CullRay, TakesHardlyAnyDirectionAsNone_Stress05) {
  const Aabb box{{-1, -1, 5}, {1, 1, 6}};
  for (const float hardly : {5.3e-17F, 1e-38F, 1e-44F, -5.30287619e-17F, -1e-38F, 0.0F, -0.0F}) {
    EXPECT_TRUE(enters({{0, 0, 0}, {hardly, 0, 1}}, box)) << hardly;
    EXPECT_TRUE(enters({{1, 0, 0}, {hardly, 0, 1}}, box)) << hardly;
    EXPECT_FALSE(enters({{1.001F, 0, 0}, {hardly, 0, 1}}, box)) << hardly;
  }
}

TEST(CullRay, DoesNotMindTheLengthOfTheDirection_Stress06) {
  Random random(6);
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 a = to_float(random.in_cube()), b = to_float(random.in_cube());
    const Aabb box{min(a, b), max(a, b)};
    const Vec3 target = box.center(), origin = to_float(random.in_cube() * 20);
    const auto scale = static_cast<float>(random.magnitude(-20, 20));
    ASSERT_TRUE(enters({origin, (target - origin) * scale}, box)) << "seed " << i << " scale " << scale;
  }
}

TEST(CullRay, IsTightToAFewRoundings) {
  const Aabb box{{0, 0, 0}, {1, 1, 1}};
  const Ray beside{{1 + 1e-4F, 0.5F, -1}, {0, 0, 1}};
  EXPECT_FALSE(enters(beside, box));
  const Interval span = CullRay({{0.5F, 0.5F, -1}, {0, 0, 1}}, box).clip(box);
  EXPECT_NEAR(span.lo, 1, 1e-5);
  EXPECT_LE(span.lo, 1);
  EXPECT_NEAR(span.hi, 2, 1e-5);
  EXPECT_GE(span.hi, 2);
}

}  // namespace
}  // namespace tessera

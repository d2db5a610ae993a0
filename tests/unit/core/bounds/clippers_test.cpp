#include <gtest/gtest.h>

#include "core/bounds/box_bound.h"
#include "core/bounds/hull_bound.h"
#include "core/bounds/slab_bound.h"
#include "core/bounds/sphere_bound.h"
#include "tests/support/random.h"

namespace tessera {
namespace {

struct SlabsOf13 : SlabBound {
  SlabsOf13() : SlabBound(slab_preset(13)) {}
};

/// What STRESS 1 to 6 ask of boxes, of the clippers of all bounds.
template <typename B>
class Clippers : public testing::Test {
 public:
  /// The volume around some points, and all of the space that rays may look for it in.
  explicit Clippers(std::vector<Vec3> points = corners({-1, -1, -1}, {1, 1, 1})) { enclose(std::move(points)); }

  static std::vector<Vec3> corners(Vec3 lo, Vec3 hi) {
    std::vector<Vec3> points;
    for (int i = 0; i < 8; ++i) points.push_back({(i & 1 ? hi : lo).x, (i & 2 ? hi : lo).y, (i & 4 ? hi : lo).z});
    return points;
  }
  void enclose(std::vector<Vec3> points) {
    reach_ = {};
    for (const Vec3 p : points) reach_.extend(p);
    Outline outline{std::move(points), {}, 0};
    volume_ = bound_.fit(outline);
  }
  Interval clip(const Ray& ray) const { return bound_.clipper(ray, reach_).clip(volume_); }
  bool enters(const Ray& ray) const { return !CullRay::misses(clip(ray), ray.t_min, ray.t_max); }

 private:
  B bound_;
  Aabb reach_;
  typename B::Volume volume_;
};
using Kinds = testing::Types<BoxBound, SphereBound, SlabsOf13, HullBound>;
TYPED_TEST_SUITE(Clippers, Kinds);

TYPED_TEST(Clippers, TakePlusAndMinusZeroAlike_Stress01) {
  for (int pattern = 0; pattern < 27; ++pattern) {
    const Vec3 d{float(pattern % 3 - 1), float(pattern / 3 % 3 - 1), float(pattern / 9 - 1)};
    if (d == Vec3{}) continue;
    for (const Vec3 aside : {Vec3{}, Vec3{0.3F, -0.2F, 0.1F}, Vec3{1, 1, 1}, Vec3{-1, 0, 1}, Vec3{2, 2, 2}}) {
      const Vec3 origin = aside - 3.0F * d;
      const Interval plain = this->clip({origin, d});
      EXPECT_TRUE(aside != Vec3{} || plain.lo <= plain.hi) << pattern;
      for (int signs = 0; signs < 8; ++signs) {
        Vec3 other = d;
        for (int axis = 0; axis < 3; ++axis)
          if (d[axis] == 0 && signs >> axis & 1) other[axis] = -0.0F;
        const Interval span = this->clip({origin, other});
        ASSERT_EQ(span.lo > span.hi, plain.lo > plain.hi) << pattern << " " << signs;
        if (span.lo > span.hi) continue;
        // A plane that the ray runs along is met far away, on this side or on that; where hits can be, all is one.
        EXPECT_FLOAT_EQ(std::max(span.lo, -100.0F), std::max(plain.lo, -100.0F)) << pattern << " " << signs;
        EXPECT_FLOAT_EQ(std::min(span.hi, 100.0F), std::min(plain.hi, 100.0F)) << pattern << " " << signs;
      }
    }
  }
}

TYPED_TEST(Clippers, HitTheClosedVolumeFromItsOwnPlanes_Stress02_Stress03) {
  EXPECT_TRUE(this->enters({{1, 0.5F, -2}, {0, 0, 1}})) << "in a face";
  EXPECT_TRUE(this->enters({{1, 0.5F, 0}, {0, 0, 1}})) << "in a face, from there";
  EXPECT_TRUE(this->enters({{1, 1, -2}, {0, 0, 1}})) << "along an edge";
  EXPECT_TRUE(this->enters({{-2, -2, -2}, {1, 1, 1}})) << "through two corners";
  EXPECT_TRUE(this->enters({{1, 1, 1}, {1, 0, 0}})) << "leaving from a corner";
}

TYPED_TEST(Clippers, NeverMissAPointInWhatHasNoThickness_Stress04) {
  Random random(4);
  for (int i = 0; i < 20'000; ++i) {
    Vec3 lo = to_float(random.in_cube()), hi = to_float(random.in_cube());
    hi[i % 3] = lo[i % 3];
    this->enclose(this->corners(lo, hi));
    Vec3 target;
    for (int axis = 0; axis < 3; ++axis)
      target[axis] = lo[axis] + static_cast<float>(random.uniform(0.05, 0.95)) * (hi[axis] - lo[axis]);
    const Vec3 origin = to_float(random.in_cube() * 10);
    ASSERT_TRUE(this->enters({origin, target - origin})) << "seed " << i;
  }
}

TYPED_TEST(Clippers, TakeHardlyAnyDirectionAsNone_Stress05) {
  this->enclose(this->corners({-1, -1, 5}, {1, 1, 6}));
  for (const float hardly : {5.3e-17F, 1e-38F, 1e-44F, -5.30287619e-17F, -1e-38F, 0.0F, -0.0F}) {
    EXPECT_TRUE(this->enters({{0, 0, 0}, {hardly, 0, 1}})) << hardly;
    EXPECT_TRUE(this->enters({{1, 0, 0}, {hardly, 0, 1}})) << hardly;
    EXPECT_FALSE(this->enters({{1.6F, 0, 0}, {hardly, 0, 1}})) << hardly;
  }
}

TYPED_TEST(Clippers, DoNotMindTheLengthOfTheDirection_Stress06) {
  int hits = 0;
  for (int seed = 0; seed < 20'000; ++seed) {
    Random random(seed);
    const Vec3 origin = to_float(random.in_cube() * 20), target = to_float(random.in_cube() * 1.5);
    const int exponent = static_cast<int>(random.bits() % 133) - 66;  // 1e-20 … 1e20
    const Vec3 d = target - origin;
    const Vec3 scaled{std::ldexp(d.x, exponent), std::ldexp(d.y, exponent), std::ldexp(d.z, exponent)};
    const Interval span = this->clip({origin, d}), other = this->clip({origin, scaled});
    ASSERT_EQ(span.lo > span.hi, other.lo > other.hi) << "seed " << seed;
    if (span.lo > span.hi) continue;
    ++hits;
    ASSERT_FLOAT_EQ(other.lo, std::ldexp(span.lo, -exponent)) << "seed " << seed;
    ASSERT_FLOAT_EQ(other.hi, std::ldexp(span.hi, -exponent)) << "seed " << seed;
  }
  EXPECT_GT(hits, 5000);
}

/// A millimetre past the side of what is two metres wide, seen from ten metres: no pad is that wide.
TYPED_TEST(Clippers, AreTightToAFewRoundings) {
  const Interval through = this->clip({{0, 0, -10}, {0, 0, 1}});
  EXPECT_LE(through.lo, 9);
  EXPECT_GE(through.hi, 11);
  const double radius = std::same_as<TypeParam, SphereBound> ? std::sqrt(3.0) : 1;
  EXPECT_NEAR(through.lo, 10 - radius, 1e-4);
  EXPECT_NEAR(through.hi, 10 + radius, 1e-4);
  EXPECT_FALSE(this->enters({{static_cast<float>(radius) + 1e-3F, 0, -10}, {0, 0, 1}}));
}

/// Coordinates whose squares and products leave the range of floats.
TYPED_TEST(Clippers, LoseNothingAtTheEndsOfTheRange) {
  for (const float scale : {1e-30F, 1e-20F, 1e20F, 1e30F}) {
    this->enclose(this->corners({-scale, -scale, -scale}, {scale, scale, scale}));
    const Interval span = this->clip({{0, 0, -10 * scale}, {0, 0, scale}});
    EXPECT_LE(span.lo, 9.0F) << scale;
    EXPECT_GE(span.lo, 8.0F) << scale;
    EXPECT_GE(span.hi, 11.0F) << scale;
    EXPECT_FALSE(this->enters({{3 * scale, 0, -10 * scale}, {0, 0, scale}})) << scale;
  }
}

}  // namespace
}  // namespace tessera

#include "core/bounds/slab_bound.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

using Normals = std::vector<Vec3>;

Outline cube() {
  Outline outline;
  for (int i = 0; i < 8; ++i) outline.points.push_back({i & 1 ? 1.0F : -1, i & 2 ? 1.0F : -1, i & 4 ? 1.0F : -1});
  return outline;
}

TEST(SlabBound, HasLeastAndGreatestAlongItsNormals) {
  Outline outline{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}}, {}, 0};
  const Slabs slabs = SlabBound(Normals{{1, 0, 0}, {0.5F, 0.5F, 0.5F}}).fit(outline);
  ASSERT_EQ(slabs.size(), 2);
  EXPECT_NEAR(slabs[0].lo, -0.5, 1e-6) << "the normal is scaled to (1/2, 0, 0)";
  EXPECT_NEAR(slabs[0].hi, 0.5, 1e-6);
  EXPECT_NEAR(slabs[1].lo, -0.5, 1e-6);
  EXPECT_NEAR(slabs[1].hi, 0.5, 1e-6);
}

/// The corner that a diagonal cuts off is outside, though inside the box.
TEST(SlabBound, CutsCornersThatABoxKeeps) {
  Outline outline{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {}, 0};
  Normals normals = slab_preset(7);
  const SlabBound bound(normals);
  const Slabs slabs = bound.fit(outline);
  EXPECT_TRUE(bound.contains(slabs, {0.3F, 0.3F, 0.3F}));
  EXPECT_FALSE(bound.contains(slabs, {0.4F, 0.4F, 0.4F}));
  const Aabb reach{{0, 0, 0}, {1, 1, 1}};
  const Ray ray{{0.6F, 0.6F, -1}, {0, 0, 1}};
  const Interval cut = bound.clipper(ray, reach).clip(slabs);
  EXPECT_GT(cut.lo, cut.hi);
  const SlabBound box(slab_preset(3));
  const Interval through = box.clipper(ray, reach).clip(box.fit(outline));
  EXPECT_NEAR(through.lo, 1, 1e-5);
  EXPECT_NEAR(through.hi, 2, 1e-5);
}

TEST(SlabBound, LengthsOfNormalsDoNotMatter) {
  for (int seed = 0; seed < 1000; ++seed) {
    Random random(seed);
    Normals unit, scaled;
    for (int i = 0; i < 5; ++i) {
      const Vec3d n = random.direction();
      unit.push_back(to_float(n));
      const auto exponent = static_cast<int>(random.bits() % 200) - 100;
      scaled.push_back(
          {std::ldexp(unit[i].x, exponent), std::ldexp(unit[i].y, exponent), std::ldexp(unit[i].z, exponent)});
    }
    const SlabBound a(unit), b(scaled);
    Outline oa = cube(), ob = cube();
    const Slabs sa = a.fit(oa), sb = b.fit(ob);
    EXPECT_EQ(sa, sb) << "seed " << seed;
    EXPECT_EQ(a.cost(sa), b.cost(sb)) << "seed " << seed;
    const Ray ray{to_float(random.in_cube() * 9), to_float(random.direction())};
    const Aabb reach{{-1, -1, -1}, {1, 1, 1}};
    EXPECT_EQ(a.clipper(ray, reach).clip(sa), b.clipper(ray, reach).clip(sb)) << "seed " << seed;
  }
}

TEST(SlabBound, CostIsHalfAreaOfTheBoxWithAxesAmongTheNormals) {
  for (const int preset : kSlabPresets) {
    const SlabBound bound(slab_preset(preset));
    Outline outline{{{0, 0, 0}, {2, 3, 5}}, {}, 0};
    EXPECT_NEAR(bound.cost(bound.fit(outline)), half_area({{0, 0, 0}, {2, 3, 5}}), 1e-4) << preset;
  }
}

TEST(SlabBound, WithoutEndInSomeDirectionIsStillABound) {
  Outline outline = cube(), same = outline;
  const SlabBound one(Normals{{0, 0, 1}, {0, 0, -3}});
  const Slabs slab = one.fit(outline);
  EXPECT_TRUE(one.contains(slab, {1e6F, -1e6F, 0}));
  EXPECT_FALSE(one.contains(slab, {0, 0, 1.001F}));
  EXPECT_TRUE(std::isfinite(one.cost(slab)));
  const SlabBound two(Normals{{1, 0, 0}, {0, 1, 0}});
  const Slabs beam = two.fit(same);
  EXPECT_TRUE(std::isfinite(two.cost(beam)));
  Outline thin{{{0, 0, 0}, {1, 0.1F, 0}}, {}, 0};
  EXPECT_LT(two.cost(two.fit(thin)), two.cost(beam));
}

TEST(SlabBound, ThinsToWhatIsOutermost) {
  Outline outline = cube();
  for (int i = 0; i < 100; ++i) outline.points.push_back({0.01F * static_cast<float>(i), 0.5F, 0.25F});
  outline.ellipsoids.push_back({{0, 0, 0}, {{0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}}});
  outline.ellipsoids.push_back({{0, 0, 0}, {{1.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}}});
  const SlabBound bound(slab_preset(13));
  const Slabs before = bound.fit(outline);
  EXPECT_LE(outline.points.size(), 8);
  EXPECT_EQ(outline.ellipsoids.size(), 1);
  EXPECT_EQ(bound.fit(outline), before);
}

TEST(SlabBound, TakesAsManyNormalsAsAllowed) {
  Random random(1);
  Normals normals;
  while (normals.size() < kMostNormals) normals.push_back(to_float(random.direction()));
  const SlabBound bound(normals);
  Outline outline = cube();
  const Interval span = bound.clipper({{0, 0, -5}, {0, 0, 1}}, {{-1, -1, -1}, {1, 1, 1}}).clip(bound.fit(outline));
  EXPECT_LE(span.lo, 4);
  EXPECT_GE(span.hi, 6);
  EXPECT_GE(span.lo, 3);
}

}  // namespace
}  // namespace tessera

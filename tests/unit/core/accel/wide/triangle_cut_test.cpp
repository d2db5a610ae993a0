#include "core/accel/wide/triangle_cut.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"
#include "tests/support/wide.h"

namespace tessera {
namespace {

Lanes lanes(Vec3 p) { return Lanes{p.x, p.y, p.z, 0}; }

/// Whether a point whose coordinates are off by `error` at most may lie in the box.
bool may_hold(const LanesBox& box, Vec3d p, double error) {
  for (int axis = 0; axis < 3; ++axis)
    if (p[axis] < box.lo[axis] - error || p[axis] > box.hi[axis] + error) return false;
  return true;
}

TEST(TriangleCut, PartsHoldWhatLiesOnTheirSide) {
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    Random random(seed);
    const double size = random.magnitude(-30, 17);
    const Vec3d center = random.in_cube() * size * random.magnitude(-3, 1);
    std::array<Vec3d, 3> p;
    for (Vec3d& corner : p) corner = to_double(to_float(center + random.in_cube() * size));
    const Corners corners{lanes(to_float(p[0])), lanes(to_float(p[1])), lanes(to_float(p[2]))};
    const int axis = static_cast<int>(seed % 3);
    const auto plane = static_cast<float>(center[axis] + size * random.uniform(-1, 1));
    const TriangleCut cut(corners, axis, plane);
    const double error = 0x1p-50 * (max_component(abs(center)) + size);
    for (int k = 0; k < 100; ++k) {
      double u = random.uniform(0, 1), v = random.uniform(0, 1);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const Vec3d point = p[0] * (1 - u - v) + p[1] * u + p[2] * v;
      EXPECT_TRUE(point[axis] > plane - error || may_hold(cut.below, point, error)) << seed;
      EXPECT_TRUE(point[axis] < plane + error || may_hold(cut.above, point, error)) << seed;
    }
  }
}

/// Where edges cross the plane, parts end; so there a box that is rounded to the nearest float would be too small.
TEST(TriangleCut, PartsHoldWhereEdgesCrossThePlane) {
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    Random random(seed);
    const double size = random.magnitude(-30, 17);
    std::array<Vec3, 3> p;
    for (Vec3& corner : p) corner = to_float(random.in_cube() * size);
    const Corners corners{lanes(p[0]), lanes(p[1]), lanes(p[2])};
    const int axis = static_cast<int>(seed % 3);
    const auto plane = static_cast<float>(size * random.uniform(-0.5, 0.5));
    const TriangleCut cut(corners, axis, plane);
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3w a = widen(p[i]), b = widen(p[(i + 1) % 3]);
      if ((a[axis] < plane) == (b[axis] < plane)) continue;
      const Vec3w point = a + (b - a) * ((plane - a[axis]) / (b[axis] - a[axis]));
      const Wide error = 0x1p-60L * static_cast<Wide>(size);
      EXPECT_LE(outside(cut.below.aabb(), point), error) << seed;
      EXPECT_LE(outside(cut.above.aabb(), point), error) << seed;
    }
  }
}

TEST(TriangleCut, PartsAreTight) {
  const Corners corners{lanes({0, 0, 0}), lanes({4, 0, 0}), lanes({0, 4, 8})};
  const TriangleCut cut(corners, 0, 1);
  EXPECT_TRUE(cut.below.aabb().contains(Aabb{{0, 0, 0}, {1, 4, 8}}));
  EXPECT_TRUE((Aabb{{0, 0, 0}, {1, 4, 8}}).contains(cut.below.aabb()));
  EXPECT_TRUE(cut.above.aabb().contains(Aabb{{1, 0, 0}, {4, 3, 6}}));
  EXPECT_TRUE((Aabb{{1, 0, 0}, {4, 3.00001F, 6.00001F}}).contains(cut.above.aabb()));
}

TEST(TriangleCut, APlaneBesideLeavesOneSideEmpty) {
  const Corners corners{lanes({0, 0, 0}), lanes({4, 0, 0}), lanes({0, 4, 8})};
  EXPECT_TRUE(TriangleCut(corners, 1, -1).below.is_empty());
  EXPECT_FALSE(TriangleCut(corners, 1, -1).above.is_empty());
  EXPECT_TRUE(TriangleCut(corners, 1, 5).above.is_empty());
}

TEST(TriangleCut, CornersInThePlaneBelongToBothSides) {
  const Corners corners{lanes({0, 0, 0}), lanes({4, 0, 0}), lanes({0, 4, 8})};
  const TriangleCut cut(corners, 1, 0);
  EXPECT_EQ(cut.below.aabb(), (Aabb{{0, 0, 0}, {4, 0, 0}}));
  EXPECT_EQ(cut.above.aabb(), (Aabb{{0, 0, 0}, {4, 4, 8}}));
}

}  // namespace
}  // namespace tessera

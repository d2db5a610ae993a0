#include "core/plan/accel_costs.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "core/plan/plan.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

std::shared_ptr<const Scene> spheres(int count) {
  SceneBuilder b;
  Random random(1);
  for (int i = 0; i < count; ++i) b.add(Sphere{to_float(random.in_cube() * 10), 0.1F});
  return b.build();
}

AccelEstimate of(const std::vector<AccelEstimate>& estimates, AccelKind kind) {
  return *std::ranges::find(estimates, kind, [](const AccelEstimate& e) { return e.options.kind; });
}

TEST(AccelCosts, TellEveryKindAndBoundOnceTheCheapestFirst) {
  const auto estimates = estimate_accels(*spheres(100), 1e5);
  EXPECT_EQ(estimates.size(), 14U) << "brute, grid, octree, kd, bsp, wide; lists and hierarchies of four bounds";
  EXPECT_TRUE(std::ranges::is_sorted(estimates, {}, &AccelEstimate::total_seconds));
  for (const AccelEstimate& e : estimates) {
    EXPECT_GE(e.build_seconds, 0);
    EXPECT_GT(e.trace_seconds, 0);
  }
}

TEST(AccelCosts, GrowWithWhatIsBuiltAndTraced) {
  const auto few = estimate_accels(*spheres(100), 1e5), many = estimate_accels(*spheres(1000), 1e5),
             rays = estimate_accels(*spheres(100), 2e5);
  for (const AccelKind kind : {AccelKind::brute, AccelKind::bounds, AccelKind::bvh, AccelKind::grid, AccelKind::octree,
                               AccelKind::kd, AccelKind::bsp, AccelKind::wide}) {
    EXPECT_GT(of(many, kind).trace_seconds, of(few, kind).trace_seconds);
    EXPECT_NEAR(of(rays, kind).trace_seconds, 2 * of(few, kind).trace_seconds, 1e-9);
    EXPECT_EQ(of(rays, kind).build_seconds, of(few, kind).build_seconds);
  }
}

TEST(AccelCosts, KnowThatAGridDoesntSuitATeapotInAStadium) {
  SceneBuilder b;
  Random random(1);
  for (int i = 0; i < 1000; ++i) b.add(Sphere{to_float(random.in_cube()), 0.01F});
  const auto even = b.build();
  SceneBuilder far;
  for (int i = 0; i < 1000; ++i) far.add(Sphere{to_float(random.in_cube()), 0.01F});
  far.add(Sphere{{1000, 1000, 1000}, 1}).add(Sphere{{-1000, -1000, -1000}, 1});
  EXPECT_GT(of(estimate_accels(*far.build(), 1e5), AccelKind::grid).trace_seconds,
            5 * of(estimate_accels(*even, 1e5), AccelKind::grid).trace_seconds);
}

TEST(AccelCosts, KnowThatBoxesDontSuitNeedles) {
  TriangleMesh needles;
  Random random(1);
  for (std::uint32_t i = 0; i < 3 * 2000; i += 3) {
    const Vec3d middle = random.in_cube(), along = random.direction(), aside = random.direction() * 1e-5;
    for (const Vec3d p : {middle - along, middle + along, middle + along + aside})
      needles.positions.push_back(to_float(p));
    needles.triangles.push_back({i, i + 1, i + 2});
  }
  const auto estimates = estimate_accels(*SceneBuilder().add(needles).build(), 1e5);
  EXPECT_LT(2 * of(estimates, AccelKind::grid).trace_seconds, of(estimates, AccelKind::bvh).trace_seconds);
  EXPECT_LT(of(estimates, AccelKind::wide).trace_seconds, of(estimates, AccelKind::octree).trace_seconds)
      << "wide splits long triangles";
}

TEST(AccelCosts, KnowThatAGroundBesideAMeshLeavesItWide) {
  const Quad ground{{{{-40, -1, 40}, {40, -1, 40}, {40, -1, -40}, {-40, -1, -40}}}};
  const auto estimates = estimate_accels(*SceneBuilder().add(icosphere(6)).add(ground).build(), 1e7);
  EXPECT_LT(of(estimates, AccelKind::wide).trace_seconds, 0.6 * of(estimates, AccelKind::bvh).trace_seconds);
}

TEST(AccelCosts, HoldForEmptyAndFlatScenes) {
  for (const auto& scene : {SceneBuilder().build(), SceneBuilder().add(grid_plane(4)).build()})
    for (const AccelEstimate& e : estimate_accels(*scene, 10))
      EXPECT_TRUE(std::isfinite(e.total_seconds()) && e.total_seconds() >= 0);
}

TEST(AccelCosts, LetTheNumberOfRaysDecide) {
  // One pixel of a mesh isn't worth a tree; a picture is.
  const auto scene = SceneBuilder().add(icosphere(5)).build();
  Settings one;
  one.width = one.height = 1;
  EXPECT_EQ(make_plan(*scene, mixed_camera(), one).accel.kind, AccelKind::brute);
  const Plan plan = make_plan(*scene, mixed_camera(), {});
  EXPECT_EQ(plan.accel.kind, AccelKind::wide);
  EXPECT_EQ(plan.candidates.size(), 14U);
  EXPECT_NE(plan.accel_because.find("20480 primitives"), std::string::npos) << plan.accel_because;
}

}  // namespace
}  // namespace tessera

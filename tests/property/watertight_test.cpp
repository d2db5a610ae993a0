// Promise 5: no ray passes between triangles that share an edge or a vertex.
#include <gtest/gtest.h>

#include "core/accel/accel.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

/// Rays from near the centre that leave a closed mesh around it unseen.
struct Leaks {
  int rays = 0;
  int leaks = 0;
};

Leaks aim_at_vertices_and_edges(const TriangleMesh& mesh, Vec3 center, double spread, AccelKind kind) {
  const auto scene = SceneBuilder().add(mesh).build();
  const auto accel = make_accel(scene, {kind});
  Random random(1);
  Leaks out;
  const auto shoot = [&](Vec3 target) {
    const Vec3 origin = to_float(to_double(center) + random.in_cube() * spread);
    const Ray ray{origin, target - origin};
    ++out.rays;
    if (!accel->closest(ray) || !accel->occluded(ray)) ++out.leaks;
  };
  for (const Vec3& p : mesh.positions) shoot(p);
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i)
      shoot(
          (mesh.positions[t[static_cast<std::size_t>(i)]] + mesh.positions[t[static_cast<std::size_t>((i + 1) % 3)]]) *
          0.5F);
  return out;
}

TEST(Watertight, AtVerticesAndEdgesOfAClosedMesh_Stress11_Stress14) {
  for (const float radius : {1.0F, 2.5F, 6.0F}) {
    const Leaks found = aim_at_vertices_and_edges(icosphere(5, radius), {}, 0.5, AccelKind::bvh);
    EXPECT_EQ(found.leaks, 0) << "of " << found.rays << " at radius " << radius;
    EXPECT_GT(found.rays, 70'000);
  }
  EXPECT_EQ(aim_at_vertices_and_edges(icosphere(2), {}, 0.5, AccelKind::brute).leaks, 0);
}

TEST(Watertight, FarFromTheOrigin_Stress12) {
  const Vec3 center{148376, 1234, -223423};
  const Leaks found = aim_at_vertices_and_edges(icosphere(4, 30, center), center, 15, AccelKind::bvh);
  EXPECT_EQ(found.leaks, 0) << "of " << found.rays;
}

TEST(Watertight, ForRandomRaysFromInside_Stress10) {
  const auto scene = SceneBuilder().add(icosphere(5)).build();
  const auto accel = make_accel(scene, {AccelKind::bvh});
  Random random(2);
  for (int i = 0; i < 200'000; ++i) {
    const Ray ray{to_float(random.in_cube() * 0.5), to_float(random.direction())};
    ASSERT_TRUE(accel->closest(ray)) << "ray " << i;
  }
}

TEST(Watertight, AcrossAnAxisAlignedGrid_Stress13) {
  const TriangleMesh mesh = grid_plane(200);
  const auto scene = SceneBuilder().add(mesh).build();
  const auto accel = make_accel(scene, {AccelKind::bvh});
  Random random(3);
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      const Vec3 a = mesh.positions[t[static_cast<std::size_t>(i)]],
                 b = mesh.positions[t[static_cast<std::size_t>((i + 1) % 3)]];
      const Vec3 target = (a + b) * 0.5F;
      ASSERT_TRUE(accel->closest({target + Vec3{0, 0, 1}, {0, 0, -1}}));
      const Vec3 origin = to_float(random.in_cube() * 0.9) + Vec3{0, 0, 2};
      if (std::abs(target.x) < 1 && std::abs(target.y) < 1) {
        ASSERT_TRUE(accel->closest({origin, target - origin}));
      }
    }
}

}  // namespace
}  // namespace tessera

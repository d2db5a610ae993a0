// Fans of the wide structure that are made by hand: each is a case that random ones hardly meet.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/accel/wide/wide_accel.h"
#include "core/accel/wide/wide_build.h"
#include "tests/property/closed_meshes.h"
#include "tests/property/mesh_parts.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

/// The ray passes the triangle's edge, far behind it, by less than its nearer corner's place in the picture is sure.
TEST(WideKernels, AgreeBesideABeamSeenFromALamp) {
  TriangleMesh mesh;
  add(mesh, {-3, 1, 2}, {3, 1, 2}, {0, 1, 300});
  const WideTree tree = build_wide(mesh);
  const Ray ray{{675, 225, 900}, {-675, -225, -900}, 0, 1};
  for (const WideKernels* kernels : runnable_wide_kernels()) {
    std::uint8_t hidden = 0;
    ASSERT_TRUE(kernels->occluded_fan(tree, 0, {0, 0, 0}, {&ray, 1}, {&hidden, 1}, nullptr));
    EXPECT_EQ(hidden, 0) << kernels->name;
  }
}

/// It stands in any of a block's places, and what it is may be any coordinate.
TEST(WideKernels, AgreeWhereOneOfAFanIsNoRay) {
  const TriangleMesh mesh = scaled(icosphere(3), 2);
  const auto brute = make_accel(SceneBuilder().add(mesh).build(), {AccelKind::brute});
  const auto wide = make_accel(SceneBuilder().add(mesh).build(), {AccelKind::wide});
  for (const float broken : {std::numeric_limits<float>::quiet_NaN(), kInfinity, 0.0F})
    for (std::size_t place = 0; place < 32; ++place)
      for (int axis = 0; axis < 3; ++axis) {
        Directions directions;
        for (std::size_t i = 0; i < 32; ++i) {
          Vec3 direction{0.02F * static_cast<float>(i % 4) - 0.03F, 0.02F * static_cast<float>(i / 4) - 0.07F, -1};
          if (i == place) direction[axis] = broken;
          directions.push_back(direction);
        }
        const RayFan fan({0, 0, 5}, directions);
        std::vector<Hit> hits(fan.size());
        wide->closest_fan(fan, hits);
        for (std::size_t i = 0; i < fan.size(); ++i)
          ASSERT_EQ(hits[i], brute->closest(fan.ray(i)).value_or(Hit{})) << broken << " at " << place << ", " << axis;
      }
}

/// The same of shadow rays. A kernel looks for itself whether all are rays, and the last stands for what a block lacks.
TEST(WideKernels, AgreeWhereOneOfTheRaysToALampIsNone) {
  const auto scene = SceneBuilder().add(icosphere(3)).build();
  const auto brute = make_accel(scene, {AccelKind::brute});
  const WideTree tree = build_wide(std::get<TriangleMesh>(scene->shapes[0]));
  const Vec3 lamp{0, 0, 8};
  const auto breaks = std::to_array<void (*)(Ray&, float)>({
      [](Ray& ray, float with) { ray.origin.x = with; },
      [](Ray& ray, float with) { ray.origin.z = with; },
      [](Ray& ray, float with) { ray.direction.y = with; },
      [](Ray& ray, float with) { ray.direction.z = with; },
      [](Ray& ray, float) { ray.direction = {}; },
      [](Ray& ray, float with) { ray.t_min = with; },
      [](Ray& ray, float with) { ray.t_max = std::abs(with); },
      [](Ray& ray, float) { ray.t_min = ray.t_max; },
      [](Ray& ray, float) { ray.t_min = -1; },
      [](Ray& ray, float) { ray.t_max = 2; },
  });
  for (const WideKernels* kernels : runnable_wide_kernels()) {
    const WideAccel wide(scene, {AccelKind::wide}, *kernels);
    for (const std::size_t size : {17, 32, 33}) {
      std::vector<Ray> whole;
      for (std::size_t i = 0; i < size; ++i) {
        const Vec3 from{0.15F * static_cast<float>(i % 4) - 1.75F, 0.08F * static_cast<float>(i / 4) - 0.3F, -5};
        whole.push_back({from, lamp - from, 0, 0.99F});
      }
      std::vector<std::uint8_t> hidden(size);
      ASSERT_TRUE(kernels->occluded_fan(tree, 0, lamp, whole, hidden, nullptr)) << kernels->name;
      for (const float with : {std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity})
        for (const auto& break_with : breaks)
          for (std::size_t place = 0; place < size; ++place) {
            std::vector<Ray> rays = whole;
            break_with(rays[place], with);
            std::ranges::fill(hidden, 0);
            ASSERT_FALSE(kernels->occluded_fan(tree, 0, lamp, rays, hidden, nullptr)) << kernels->name << " " << place;
            wide.occluded_fan(lamp, rays, hidden, {});
            EXPECT_NE(std::ranges::count(hidden, 0), 0);
            EXPECT_NE(std::ranges::count(hidden, 1), 0);
            for (std::size_t i = 0; i < size; ++i)
              ASSERT_EQ(hidden[i], brute->occluded(rays[i])) << kernels->name << ", " << with << " at " << place;
          }
    }
  }
}

/// Most blocks lie outside an edge of a wall, some astride it; what stands before and behind crosses it.
TEST(WideKernels, AgreeOnWallsThatBlocksLieBeside) {
  Random random(3);
  for (int round = 0; round < 60; ++round) {
    TriangleMesh mesh;
    for (int wall = 0; wall < 4; ++wall) {
      const double far = random.uniform(5, 9), size = random.uniform(1, 6);
      const auto corner = [&] { return random.in_cube() * size + Vec3d{0, 0, -far}; };
      add(mesh, corner(), corner(), corner());
    }
    const auto brute = make_accel(SceneBuilder().add(mesh).build(), {AccelKind::brute});
    const WideTree tree = build_wide(mesh);
    Directions directions;
    for (int i = 0; i < static_cast<int>(kFanRays); ++i) {
      const int block = i / 16, x = block % 8 * 4 + i % 4, y = block / 8 * 4 + i % 16 / 4;
      directions.push_back({0.05F * static_cast<float>(x - 16), 0.05F * static_cast<float>(y - 16), -1});
    }
    const RayFan fan({0, 0, 0}, directions);
    for (const WideKernels* kernels : runnable_wide_kernels()) {
      std::vector<Hit> hits(fan.size());
      ASSERT_TRUE(kernels->closest_fan(tree, 0, fan, hits, nullptr));
      for (std::size_t i = 0; i < fan.size(); ++i)
        ASSERT_EQ(hits[i], brute->closest(fan.ray(i)).value_or(Hit{})) << kernels->name << ", ray " << i;
    }
  }
}

/// Each ray meets six triangles of its own, in any order.
TEST(WideKernels, AgreeWhereAFanTakesMoreThanItKeeps) {
  Random random(1);
  TriangleMesh mesh;
  Directions directions;
  const Vec3 eye{16, 16, 100};
  for (int i = 0; i < static_cast<int>(kFanRays); ++i) {
    const Vec3d at{i % 32 + 0.5, i / 32 + 0.5, 0};
    directions.push_back(to_float(at) - eye);
    for (int layer = 0; layer < 6; ++layer) {
      const Vec3d middle = at + Vec3d{0, 0, random.uniform(-0.1, 0.1)};
      add(mesh, middle + Vec3d{-0.2, -0.2, 0}, middle + Vec3d{0.2, -0.2, 0}, middle + Vec3d{0, 0.3, 0});
    }
  }
  const RayFan fan(eye, directions);
  const auto brute = make_accel(SceneBuilder().add(mesh).build(), {AccelKind::brute});
  const WideTree tree = build_wide(mesh);
  for (const WideKernels* kernels : runnable_wide_kernels()) {
    std::vector<Hit> hits(fan.size());
    ASSERT_TRUE(kernels->closest_fan(tree, 0, fan, hits, nullptr));
    for (std::size_t i = 0; i < fan.size(); ++i) ASSERT_EQ(hits[i], brute->closest(fan.ray(i))) << kernels->name;
  }
}

}  // namespace
}  // namespace tessera

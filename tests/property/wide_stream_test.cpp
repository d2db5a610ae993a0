// More rays than the wide structure takes through a tree together.
#include <gtest/gtest.h>

#include "core/accel/wide/wide_build.h"
#include "core/accel/wide/wide_kernels.h"
#include "tests/property/closed_meshes.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

/// Twice what a stream holds, and some: each of its rays answers for itself, and none for another's.
TEST(WideKernels, AgreeOnMoreRaysThanAStreamHolds) {
  const TriangleMesh mesh = icosphere(4);
  const auto brute = make_accel(SceneBuilder().add(mesh).build(), {AccelKind::brute});
  const WideTree tree = build_wide(mesh);
  Random random(1);
  std::vector<Ray> some(300);
  std::vector<Hit> expected;
  for (Ray& ray : some) {
    ray.origin = to_float(random.in_cube() * 1.5);
    ray.direction = to_float(random.direction());
    expected.push_back(brute->closest(ray).value_or(Hit{}));
  }
  std::vector<Ray> rays(2 * kStreamRays + 4464);
  const auto which = [&](std::size_t i) { return (i + i / some.size() * 7) % some.size(); };
  for (std::size_t i = 0; i < rays.size(); ++i) rays[i] = some[which(i)];
  for (const WideKernels* kernels : runnable_wide_kernels()) {
    std::vector<Hit> hits(rays.size());
    kernels->closest(tree, 0, rays, hits, nullptr);
    std::vector<std::uint8_t> hidden(rays.size());
    kernels->occluded(tree, 0, rays, hidden, nullptr);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_EQ(hits[i], expected[which(i)]) << kernels->name << ", ray " << i;
      ASSERT_EQ(hidden[i], expected[which(i)].t < kInfinity) << kernels->name << ", ray " << i;
    }
  }
}

}  // namespace
}  // namespace tessera

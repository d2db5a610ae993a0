#include "core/accel/build_stop.h"

#include <memory>

#include <gtest/gtest.h>

#include "core/accel/accel_table.h"
#include "core/accel/wide/wide_build.h"
#include "core/accel/wide/work_crew.h"
#include "core/scene/frame_scene.h"
#include "tests/support/meshes.h"

namespace tessera {
namespace {

std::stop_token stopped() {
  std::stop_source stop;
  stop.request_stop();
  return stop.get_token();
}

std::shared_ptr<const Scene> scene_of_a_mesh() {
  Scene scene;
  scene.materials.emplace_back();
  scene.shapes.emplace_back(icosphere(4));
  scene.objects.push_back({0, 0, std::nullopt});
  return std::make_shared<const Scene>(with_bounds(std::move(scene)));
}

TEST(BuildStop, EveryStructureThatIsBuiltCanBeStopped) {
  const auto scene = scene_of_a_mesh();
  for (const AccelEntry& row : accel_table()) {
    if (!row.builds || row.kind == AccelKind::wide) continue;  // That one builds when rays come.
    {
      const BuildStop stop(stopped());
      EXPECT_THROW(make_accel(scene, {row.kind}), BuildStopped) << row.name;
    }
    EXPECT_TRUE(make_accel(scene, {row.kind})) << row.name;
  }
  for (const BoundKind bound : {BoundKind::sphere, BoundKind::slabs, BoundKind::hull}) {
    const BuildStop stop(stopped());
    AccelOptions options{AccelKind::bvh};
    options.bound = bound;
    EXPECT_THROW(make_accel(scene, options), BuildStopped);
  }
}

TEST(BuildStop, SoCanAMeshsHierarchyOnAnyThreads) {
  const TriangleMesh mesh = icosphere(5);
  for (const unsigned threads : {1U, 2U, 8U}) {
    const BuildStop stop(stopped());
    EXPECT_THROW(build_wide(mesh, {.threads = threads}), BuildStopped);
  }
  EXPECT_FALSE(build_wide(mesh).nodes.empty());
}

TEST(BuildStop, IsKnownToThreadsThatHelp) {
  std::stop_source stop;
  const BuildStop build(stop.get_token());
  EXPECT_THROW(for_each_index(8, 8,
                              [&](std::size_t) {
                                stop.request_stop();
                                BuildStop::check();
                              }),
               BuildStopped);
}

TEST(BuildStop, TheInnermostCounts) {
  BuildStop::check();
  const BuildStop outer(stopped());
  {
    const BuildStop inner{std::stop_token()};
    BuildStop::check();
  }
  EXPECT_THROW(BuildStop::check(), BuildStopped);
}

}  // namespace
}  // namespace tessera

#include "core/accel/wide/lazy_tree.h"

#include <latch>
#include <new>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

#include "core/accel/wide/wide_accel.h"
#include "core/accel/wide/wide_build.h"
#include "tests/support/same_hits.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

constexpr int kThreads = 8, kRounds = 100;

/// Runs `work(thread)` on all threads, begun at once.
template <typename Work>
void at_once(Work&& work) {
  std::latch start(kThreads);
  std::vector<std::jthread> threads;
  for (int i = 0; i < kThreads; ++i)
    threads.emplace_back([&, i] {
      start.arrive_and_wait();
      work(i);
    });
}

TEST(LazyTree, IsMadeOnceHoweverManyAsk) {
  const TriangleMesh mesh = icosphere(1);
  std::atomic<int> made = 0;
  const MakeTree make = [&](const TriangleMesh& asked) {
    EXPECT_EQ(&asked, &mesh);
    ++made;
    return MadeTree{build_wide(asked, {.threads = 1}), true};
  };
  for (int round = 0; round < kRounds; ++round) {
    const LazyTree tree{};
    EXPECT_EQ(tree.ready(), nullptr);
    at_once([&](int) { EXPECT_GT(tree.get([&] { return make(mesh); }).nodes.size(), 1U); });
    EXPECT_TRUE(tree.ready()->made.was_kept);
  }
  EXPECT_EQ(made, kRounds);
}

TEST(LazyTree, IsTriedAgainByTheNextOneWhenMakingItFails) {
  const TriangleMesh mesh = icosphere(1);
  for (int round = 0; round < kRounds; ++round) {
    std::atomic<int> tries = 0, failures = 0;
    const MakeTree make = [&](const TriangleMesh& asked) {
      if (++tries <= 3) throw std::runtime_error("no luck");
      return MadeTree{build_wide(asked, {.threads = 1})};
    };
    const LazyTree tree{};
    at_once([&](int) {
      try {
        EXPECT_FALSE(tree.get([&] { return make(mesh); }).nodes.empty());
      } catch (const std::runtime_error&) {
        ++failures;
      }
    });
    EXPECT_EQ(failures, 3);
    EXPECT_EQ(tries, 4);
  }
}

/// Three small balls along x; between rays down z there is room for others.
std::shared_ptr<const Scene> three_balls() {
  SceneBuilder b;
  for (const float x : {0.0F, 10.0F, 20.0F}) b.add(icosphere(2, 1, {x, 0, 0}));
  return b.build();
}

Ray down_at(float x, float y = 0.1F) { return {{x, y, 5}, {0, 0, -1}}; }

TEST(WideAccelMeshes, AreMadeWhenARayEntersTheirBox) {
  const WideAccel accel(three_balls(), {AccelKind::wide});
  const auto ready = [&] { return accel.stats().meshes_ready; };
  EXPECT_EQ(accel.stats().meshes, 3U);
  const std::uint64_t bytes = accel.stats().bytes;
  EXPECT_FALSE(accel.closest(down_at(5), {}));
  EXPECT_FALSE(accel.occluded(down_at(11.5F), {}));
  EXPECT_EQ(ready(), 0U) << "beside the boxes";
  EXPECT_FALSE(accel.occluded({{10, 0, 5}, {0, 0, -1}, 0, 3}, {}));
  EXPECT_EQ(ready(), 0U) << "ends before it";
  EXPECT_FALSE(accel.closest(down_at(10.9F, 0.9F), {}));
  EXPECT_EQ(ready(), 1U) << "in the box and beside the ball";
  EXPECT_TRUE(accel.occluded(down_at(10), {}));
  EXPECT_EQ(ready(), 1U);
  EXPECT_EQ(accel.closest(down_at(20), {})->object, 2U);
  EXPECT_EQ(ready(), 2U);
  EXPECT_GT(accel.stats().bytes, bytes);
  EXPECT_GT(accel.stats().mesh_seconds, 0);
  EXPECT_EQ(accel.stats().meshes_loaded, 0U);
}

TEST(WideAccelMeshes, AreMadeForFansThatEnterTheirBox) {
  const auto accel = make_accel(three_balls(), {AccelKind::wide});
  Directions directions;
  for (int i = 0; i < 256; ++i)
    directions.push_back({0.01F * static_cast<float>(i % 16 - 8), 0.01F * static_cast<float>(i / 16 - 8), -1});
  std::vector<Hit> hits(256);
  accel->closest_fan({{10, 0, 5}, directions}, hits);
  EXPECT_EQ(accel->stats().meshes_ready, 1U);
}

TEST(WideAccelMeshes, OneThatIsAllThereIsIsMadeAtOnce) {
  const WideAccel accel(SceneBuilder().add(icosphere(2)).build(), {AccelKind::wide});
  EXPECT_EQ(accel.stats().meshes_ready, 1U);
}

TEST(WideAccelMeshes, AreFoundByAllThreadsAtOnce) {
  const auto scene = random_scene(3, 60);
  Random random(1);
  std::vector<Ray> rays;
  for (int i = 0; i < 200; ++i) rays.push_back({to_float(random.in_cube() * 20), to_float(random.direction())});
  const auto known = known_rays(scene, rays);
  for (int round = 0; round < 10; ++round) {
    const auto accel = make_accel(scene, {AccelKind::wide});
    at_once([&](int) { expect_same_hits(*accel, known, "at once"); });
  }
}

TEST(WideAccelMeshes, FailTheRayThatTheyAreMadeFor) {
  bool fails = true;
  const WideAccel accel(three_balls(), {AccelKind::wide}, wide_kernels(), [&](const TriangleMesh& mesh) {
    if (fails) throw std::bad_alloc();
    return MadeTree{build_wide(mesh)};
  });
  EXPECT_THROW(accel.closest(down_at(10), {}), std::bad_alloc);
  EXPECT_THROW(accel.occluded(down_at(10), {}), std::bad_alloc);
  EXPECT_EQ(accel.stats().meshes_ready, 0U);
  fails = false;
  EXPECT_TRUE(accel.closest(down_at(10), {}));
}

}  // namespace
}  // namespace tessera

#include "server/store/structure_cache.h"

#include <atomic>
#include <future>
#include <latch>
#include <stdexcept>
#include <stop_token>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/accel/build_stop.h"

namespace tessera::server {
namespace {

std::shared_ptr<const Scene> scene_of_spheres(int count) {
  Scene scene;
  scene.materials.emplace_back();
  for (int i = 0; i < count; ++i) {
    scene.shapes.emplace_back(Sphere{{static_cast<float>(3 * i), 0, 0}, 1});
    scene.objects.push_back({static_cast<std::uint32_t>(i), 0, std::nullopt});
  }
  return std::make_shared<const Scene>(with_bounds(std::move(scene)));
}

struct Answer {
  std::shared_ptr<const Structure> structure;
  bool shared = false;
  std::exception_ptr error;
};

Answer ask(StructureCache& cache, const std::string& hash, const std::shared_ptr<const Scene>& scene,
           AccelKind kind = AccelKind::bvh) {
  Answer answer;
  cache.get_or_build(hash, scene, {kind},
                     [&](std::shared_ptr<const Structure> structure, bool shared, std::exception_ptr error) {
                       answer = {std::move(structure), shared, error};
                     });
  return answer;
}

TEST(StructureCache, KeepsOneForEachSceneAndKind) {
  StructureCache cache(1 << 30);
  const auto scene = scene_of_spheres(10);
  const Answer first = ask(cache, "a", scene), second = ask(cache, "a", scene);
  EXPECT_FALSE(first.shared);
  EXPECT_TRUE(second.shared);
  EXPECT_EQ(first.structure, second.structure);
  EXPECT_EQ(first.structure->options.kind, AccelKind::bvh);
  EXPECT_EQ(first.structure->scene, scene);
  EXPECT_EQ(ask(cache, "a", scene_of_spheres(10)).structure->scene, scene);
  EXPECT_GT(first.structure->accel->stats().bytes, 0U);
  EXPECT_FALSE(ask(cache, "a", scene, AccelKind::brute).shared);
  EXPECT_FALSE(ask(cache, "b", scene).shared);
}

TEST(StructureCache, BuildsOnceForAllWhoAskAtOnce) {
  constexpr int kThreads = 8, kRounds = 50;
  std::atomic<int> builds = 0;
  StructureCache cache(1 << 30, [&](std::shared_ptr<const Scene> scene, const AccelOptions& options) {
    ++builds;
    return make_accel(std::move(scene), options);
  });
  const auto scene = scene_of_spheres(500);
  for (int round = 0; round < kRounds; ++round) {
    std::latch start(kThreads), left(kThreads);
    std::atomic<int> unshared = 0;
    std::vector<std::jthread> threads;
    for (int i = 0; i < kThreads; ++i)
      threads.emplace_back([&] {
        start.arrive_and_wait();
        cache.get_or_build(std::to_string(round), scene, {AccelKind::bvh},
                           [&](const auto& structure, bool shared, const std::exception_ptr&) {
                             EXPECT_TRUE(structure);
                             if (!shared) ++unshared;
                             left.count_down();
                           });
      });
    left.wait();
    EXPECT_EQ(unshared, 1) << "round " << round;
    EXPECT_EQ(builds, round + 1);
  }
}

TEST(StructureCache, WhoAsksDuringTheBuildDoesNotWait) {
  std::promise<void> begun, go;
  StructureCache cache(1 << 30, [&](std::shared_ptr<const Scene> scene, const AccelOptions& options) {
    begun.set_value();
    go.get_future().wait();
    return make_accel(std::move(scene), options);
  });
  const auto scene = scene_of_spheres(10);
  Answer first, second;
  std::thread builder([&] { first = ask(cache, "a", scene); });
  begun.get_future().wait();
  std::thread::id answered_by;
  cache.get_or_build("a", scene, {AccelKind::bvh}, [&](auto structure, bool shared, std::exception_ptr) {
    second = {std::move(structure), shared, nullptr};
    answered_by = std::this_thread::get_id();
  });
  EXPECT_FALSE(second.structure);
  const std::thread::id builder_id = builder.get_id();
  go.set_value();
  builder.join();
  EXPECT_EQ(first.structure, second.structure);
  EXPECT_TRUE(second.shared);
  EXPECT_EQ(answered_by, builder_id);
}

TEST(StructureCache, LetsGoOfWhatDoesNotFit) {
  StructureCache cache(1);
  const auto scene = scene_of_spheres(10);
  const Answer first = ask(cache, "a", scene);
  EXPECT_TRUE(first.structure);
  EXPECT_EQ(first.structure.use_count(), 1);
  EXPECT_FALSE(ask(cache, "a", scene).shared);
}

TEST(StructureCache, AFailureIsToldAndNotKept) {
  int builds = 0;
  StructureCache cache(1 << 30, [&](std::shared_ptr<const Scene> scene, const AccelOptions& options) {
    if (++builds == 1) throw std::runtime_error("no luck");
    return make_accel(std::move(scene), options);
  });
  const auto scene = scene_of_spheres(10);
  const Answer failed = ask(cache, "a", scene);
  EXPECT_TRUE(failed.error);
  EXPECT_FALSE(failed.structure);
  EXPECT_TRUE(ask(cache, "a", scene).structure);
}

TEST(StructureCache, ABuildEndsWhenNobodyWantsItAnyMore) {
  std::promise<void> begun;
  std::atomic<int> steps = 0;
  bool is_endless = true;
  StructureCache cache(1 << 30, [&](std::shared_ptr<const Scene> scene, const AccelOptions& options) {
    if (is_endless) begun.set_value();
    for (; is_endless; ++steps) BuildStop::check();
    return make_accel(std::move(scene), options);
  });
  const auto scene = scene_of_spheres(10);
  std::stop_source first, second;
  std::exception_ptr error;
  int told = 0;
  const StructureCache::Done done = [&](const auto& structure, bool, std::exception_ptr what) {
    EXPECT_FALSE(structure);
    error = std::move(what);
    ++told;
  };
  std::thread builder([&] { cache.get_or_build("a", scene, {AccelKind::bvh}, done, first.get_token()); });
  begun.get_future().wait();
  const auto asking = cache.get_or_build("a", scene, {AccelKind::bvh}, done, second.get_token());
  first.request_stop();
  for (const int before = steps; steps < before + 1000;) std::this_thread::yield();  // It goes on for the other one.
  second.request_stop();
  builder.join();
  EXPECT_EQ(told, 2);
  EXPECT_THROW(std::rethrow_exception(error), BuildStopped);
  is_endless = false;
  EXPECT_TRUE(ask(cache, "a", scene).structure);
}

TEST(StructureCache, CountsWhatHasGrown) {
  struct Growing : Accel {
    explicit Growing(const std::uint64_t& size) : size_(size) {}
    std::optional<Hit> closest(const Ray&, TraceLog) const override { return std::nullopt; }
    bool occluded(const Ray&, TraceLog) const override { return false; }
    std::optional<Hit> closest_among(const Ray&, std::span<const std::uint32_t>, TraceLog) const override {
      return std::nullopt;
    }
    std::optional<Hit> coincident(const Ray&, const Hit&, TraceLog) const override { return std::nullopt; }
    AccelStats stats() const override { return {.bytes = size_}; }
    const std::uint64_t& size_;
  };
  std::uint64_t bytes = 100'000;
  StructureCache cache(1'000'000, [&](std::shared_ptr<const Scene>, const AccelOptions&) {
    return std::make_unique<const Growing>(bytes);
  });
  const auto scene = scene_of_spheres(1);
  const auto grown = ask(cache, "grown", scene).structure;
  ask(cache, "other", scene);
  bytes = 500'000;
  cache.recount("grown", grown);
  EXPECT_TRUE(ask(cache, "other", scene).shared) << "there is room for both";
  bytes = 950'000;
  cache.recount("grown", grown);
  EXPECT_TRUE(ask(cache, "grown", scene).shared);
  bytes = 100'000;
  EXPECT_FALSE(ask(cache, "other", scene).shared) << "it had to go";
  EXPECT_FALSE(ask(cache, "grown", scene).shared) << "and now this, which is counted as it was";
  cache.recount("grown", grown);
  EXPECT_TRUE(ask(cache, "grown", scene).shared);
  EXPECT_NE(ask(cache, "grown", scene).structure, grown) << "what has gone doesn't come back";
}

std::shared_ptr<const Scene> scene_of_lamps(std::uint32_t count) {
  Scene scene = *scene_of_spheres(1);
  scene.lights.assign(count, PointLight{{0, 5, 0}, {1, 1, 1}});
  return std::make_shared<const Scene>(std::move(scene));
}

TEST(StructureCache, KeepsTheLightsOfAScene) {
  StructureCache cache(1 << 30);
  const auto structure = ask(cache, "a", scene_of_lamps(3)).structure;
  EXPECT_EQ(structure->lights->bytes(), 0U) << "nobody needs them yet";
  const auto lights = structure->lights->get(structure->scene);
  ASSERT_TRUE(lights);
  EXPECT_EQ(lights->count(), 3U);
  const auto again = ask(cache, "a", scene_of_lamps(3)).structure;
  EXPECT_EQ(again->lights->get(again->scene), lights);
  EXPECT_EQ(structure->lights->bytes(), lights->bytes());
}

TEST(StructureCache, LightsAreMadeOnceForAllWhoAskAtOnce) {
  const auto scene = scene_of_lamps(1000);
  const SceneLights lights;
  std::latch start(8);
  std::vector<std::shared_ptr<const LightTable>> found(8);
  {
    std::vector<std::jthread> threads;
    for (auto& mine : found)
      threads.emplace_back([&] {
        start.arrive_and_wait();
        mine = lights.get(scene);
      });
  }
  for (const auto& one : found) EXPECT_EQ(one, found[0]);
}

TEST(StructureCache, LightsCountByWhatTheyTake) {
  const auto scene = scene_of_lamps(10'000);  // A table takes 72 bytes a light, and more.
  for (const bool is_large : {false, true}) {
    StructureCache cache((is_large ? 2'000'000U : 500'000U) + memory_bytes(*scene));
    const auto structure = ask(cache, "a", scene).structure;
    structure->lights->get(scene);
    cache.recount("a", structure);
    EXPECT_EQ(ask(cache, "a", scene).shared, is_large);
  }
}

}  // namespace
}  // namespace tessera::server

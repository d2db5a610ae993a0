// Tiles that are stopped and taken up again, repeated, or rendered in any order by any threads.
#include <algorithm>
#include <atomic>
#include <memory>
#include <numeric>
#include <optional>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/render/tile_renderer.h"
#include "tests/support/image.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

/// A structure that requests a stop at its n-th question.
class StopsAfter final : public Accel {
 public:
  StopsAfter(std::shared_ptr<const Accel> inner, int questions, std::stop_source stop)
      : inner_(std::move(inner)), left_(questions), stop_(std::move(stop)) {}

  std::optional<Hit> closest(const Ray& ray, TraceLog log) const override {
    count();
    return inner_->closest(ray, log);
  }
  std::optional<Hit> closest_among(const Ray& ray, std::span<const std::uint32_t> objects,
                                   TraceLog log) const override {
    count();
    return inner_->closest_among(ray, objects, log);
  }
  bool occluded(const Ray& ray, TraceLog log) const override {
    count();
    return inner_->occluded(ray, log);
  }
  std::optional<Hit> coincident(const Ray& ray, const Hit& hit, TraceLog log) const override {
    return inner_->coincident(ray, hit, log);
  }
  AccelStats stats() const override { return inner_->stats(); }

 private:
  void count() const {
    if (--left_ == 0) stop_.request_stop();
  }
  std::shared_ptr<const Accel> inner_;
  mutable std::atomic<int> left_;
  mutable std::stop_source stop_;
};

RenderContext context_for(ScreenBounds bounds) {
  const auto scene = mixed_scene();
  Settings settings;
  settings.width = settings.height = 40;
  settings.samples = 2;
  settings.tile_size = 13;
  settings.screen_bounds = bounds;
  settings.aovs = {Aov::depth, Aov::normal, Aov::primitive_id, Aov::object_id};
  const Plan plan = make_plan(*scene, mixed_camera(), settings);
  return {scene, make_accel(scene, plan.accel), settings, plan, CameraRays(mixed_camera(), 40, 40)};
}

PassWork all_samples(const RenderContext& context, std::size_t tile) {
  const Settings& settings = context.settings;
  auto pass = std::make_shared<const Pass>(settings.width, settings.height, SampleRange{0, settings.samples});
  return {std::move(pass), context.plan.tiling.tiles[tile].rect, settings};
}

std::vector<PixelRect> tile_rects(const RenderContext& context) {
  std::vector<PixelRect> out;
  for (const Tile& tile : context.plan.tiling.tiles) out.push_back(tile.rect);
  return out;
}

TEST(Tiles, StoppedMidwayAndRepeatedGiveTheSameBytes_Stress53) {
  const RenderContext context = context_for(ScreenBounds::flat);
  for (std::size_t tile = 0; tile < context.plan.tiling.tiles.size(); ++tile) {
    const auto expected = render_tile(context, tile);
    for (const int questions : {1, 2, 7, 100}) {
      std::stop_source stop;
      RenderContext stopping = context;
      stopping.accel = std::make_shared<const StopsAfter>(context.accel, questions, stop);
      const auto result = render_tile(stopping, tile, stop.get_token());
      EXPECT_EQ(result.has_value(), !stop.stop_requested()) << "all of it or nothing";
      const auto again = render_tile(context, tile);
      EXPECT_TRUE(same_bytes(expected->pixels, again->pixels)) << "tile " << tile << " stopped after " << questions;
      EXPECT_EQ(expected->rays, again->rays);
    }
  }
}

TEST(Tiles, InStepsOnAnyThreadsGiveTheSameBytes) {
  for (const bool costs : {false, true}) {
    RenderContext context = context_for(ScreenBounds::flat);
    if (costs) context.settings.aovs = {Aov::cost_volumes, Aov::cost_primitives};
    context.settings.samples = costs ? 2 : 40;
    for (std::size_t tile = 0; tile < context.plan.tiling.tiles.size(); ++tile) {
      const auto expected = render_tile(context, tile);
      TileRenderer renderer(context, tile, all_samples(context, tile));
      std::uint64_t samples = 0;
      std::size_t steps = 1;
      const auto step = [&] { return renderer.go_on([] { return true; }); };
      for (bool is_done = false; !is_done; ++steps) {
        if (steps < 100)
          std::jthread([&] { is_done = step(); }).join();
        else
          is_done = step();
        ASSERT_GE(renderer.samples_done(), samples);
        samples = renderer.samples_done();
      }
      EXPECT_TRUE(renderer.finish());
      const bool is_empty = context.plan.tiling.tiles[tile].first_level == FirstLevel::nothing;
      EXPECT_TRUE(is_empty || steps > context.scene->lights.size()) << "a step is one batch of rays, of one kind";
      EXPECT_EQ(samples, static_cast<std::uint64_t>(expected->pixels.rect.area()) * context.settings.samples);
      EXPECT_TRUE(same_bytes(expected->pixels, renderer.result().pixels)) << "tile " << tile;
      EXPECT_EQ(expected->rays, renderer.result().rays);
      EXPECT_EQ(expected->tests, renderer.result().tests);
    }
  }
}

TEST(Tiles, WhateverIsTracedTogetherGivesTheSameBytes) {
  RenderContext context = context_for(ScreenBounds::flat);
  context.settings.samples = 11;
  for (std::size_t tile = 0; tile < context.plan.tiling.tiles.size(); ++tile) {
    *context.chunk = 1024;
    const auto expected = render_tile(context, tile);
    for (const std::size_t size : {1, 7, 64, 1000}) {
      *context.chunk = size;
      const auto result = render_tile(context, tile);
      EXPECT_TRUE(same_bytes(expected->pixels, result->pixels)) << "tile " << tile << ", " << size << " at a time";
      EXPECT_EQ(expected->rays, result->rays);
    }
  }
}

/// Splits a tile again and again, wherever it has come to, and renders all parts in steps, in a random order.
TileResult render_in_parts(const RenderContext& context, std::size_t tile, std::uint32_t seed, std::size_t& parts) {
  std::mt19937 random(seed);
  std::vector<std::unique_ptr<TileRenderer>> open;
  open.push_back(std::make_unique<TileRenderer>(context, tile, all_samples(context, tile)));
  std::optional<TileResult> result;
  parts = 1;
  while (!open.empty()) {
    const std::size_t at = random() % open.size();
    if (random() % 3 == 0) {
      if (auto rest = open[at]->split()) {
        open.push_back(std::move(rest));
        ++parts;
      }
    } else if (open[at]->go_on([&] { return random() % 4 > 0; })) {
      const bool is_last = open[at]->finish();
      EXPECT_EQ(is_last, open.size() == 1);
      if (is_last) result = open[at]->take_result();
      open.erase(open.begin() + static_cast<std::ptrdiff_t>(at));
    }
  }
  return *std::move(result);
}

TEST(Tiles, InPartsGiveTheSameBytes) {
  RenderContext context = context_for(ScreenBounds::flat);
  context.settings.samples = 40;
  context.settings.aovs = {Aov::depth, Aov::normal, Aov::variance, Aov::albedo, Aov::sample_count};
  std::size_t most = 0;
  for (std::size_t tile = 0; tile < context.plan.tiling.tiles.size(); ++tile) {
    const auto expected = render_tile(context, tile);
    for (std::uint32_t seed = 0; seed < 4; ++seed) {
      std::size_t parts;
      const TileResult result = render_in_parts(context, tile, seed, parts);
      most = std::max(most, parts);
      EXPECT_TRUE(same_bytes(expected->pixels, result.pixels)) << "tile " << tile << ", seed " << seed;
      EXPECT_EQ(expected->rays, result.rays);
    }
  }
  EXPECT_GE(most, 4U);
}

TEST(Tiles, PartsOnThreadsGiveTheSameBytes) {
  RenderContext context = context_for(ScreenBounds::flat);
  context.settings.samples = 40;
  for (std::size_t tile = 0; tile < context.plan.tiling.tiles.size(); ++tile) {
    const auto expected = render_tile(context, tile);
    std::vector<std::unique_ptr<TileRenderer>> parts;
    parts.push_back(std::make_unique<TileRenderer>(context, tile, all_samples(context, tile)));
    for (std::size_t i = 0; i < parts.size() && parts.size() < 4; ++i)
      if (auto rest = parts[i]->split()) parts.push_back(std::move(rest));
    std::atomic<int> last = 0;
    {
      std::vector<std::jthread> threads;
      for (const auto& part : parts)
        threads.emplace_back([&] {
          EXPECT_TRUE(part->go_on([] { return false; }));
          last += part->finish() ? 1 : 0;
        });
    }
    EXPECT_EQ(last, 1);
    EXPECT_TRUE(same_bytes(expected->pixels, parts.front()->result().pixels)) << "tile " << tile;
  }
}

/// How many tests rays take may depend on which of them go together.
TEST(Tiles, ThatCountTestsAreNotSplit) {
  RenderContext context = context_for(ScreenBounds::flat);
  context.settings.samples = 40;
  context.settings.count_tests = true;
  EXPECT_EQ(TileRenderer(context, 4, all_samples(context, 4)).split(), nullptr);
  context.settings.count_tests = false;
  EXPECT_NE(TileRenderer(context, 4, all_samples(context, 4)).split(), nullptr);
}

TEST(Tiles, GoOnAfterAStop) {
  const RenderContext context = context_for(ScreenBounds::off);
  const auto expected = render_tile(context, 4);
  std::stop_source stop;
  stop.request_stop();
  TileRenderer renderer(context, 4, all_samples(context, 4));
  EXPECT_FALSE(renderer.go_on([&] { return stop.stop_requested(); }));
  EXPECT_LT(renderer.samples_done(), static_cast<std::uint64_t>(expected->pixels.rect.area()) * 2);
  EXPECT_TRUE(renderer.go_on([] { return false; }));
  EXPECT_TRUE(renderer.finish());
  EXPECT_TRUE(same_bytes(expected->pixels, renderer.result().pixels));
  EXPECT_EQ(expected->rays, renderer.result().rays);
}

TEST(Tiles, InAnyOrderOnAnyThreadsGiveTheSameImage_Stress52_Stress53) {
  for (const ScreenBounds bounds : {ScreenBounds::off, ScreenBounds::flat, ScreenBounds::hierarchical}) {
    const RenderContext context = context_for(bounds);
    const Pixels reference = render_image(context.scene, mixed_camera(), context.settings).pixels;
    const std::size_t count = context.plan.tiling.tiles.size();
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), 0);
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
      Random random(seed);
      for (std::size_t i = count; i > 1; --i) std::swap(order[i - 1], order[random.bits() % i]);
      Film film(context.settings.width, context.settings.height, context.settings.aovs, tile_rects(context));
      std::vector<std::jthread> pool;
      for (std::size_t t = 0; t < 3; ++t)
        pool.emplace_back([&, t] {
          for (std::size_t i = t; i < count; i += 3) {
            if (i % 2 == 0) render_tile(context, order[i]);  // a first try whose result is lost
            film.store(order[i], render_tile(context, order[i])->pixels);
          }
        });
      pool.clear();
      EXPECT_TRUE(same_bytes(reference, film.pixels()))
          << "screen bounds " << static_cast<int>(bounds) << " order " << seed;
    }
  }
}

}  // namespace
}  // namespace tessera

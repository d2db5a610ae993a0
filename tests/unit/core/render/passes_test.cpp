// Images that are rendered in passes: stopped, resumed and shared out in whatever way.
#include "core/film/passes.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <numeric>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/render/tile_renderer.h"
#include "tests/support/image.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

Settings small(std::uint32_t samples) {
  Settings settings;
  settings.width = 50;
  settings.height = 40;
  settings.samples = samples;
  settings.tile_size = 13;
  for (const AovEntry& row : aov_table()) settings.aovs.insert(row.aov);
  // Structures count what they test, and that depends on how many rays go together.
  settings.aovs.erase(Aov::cost_volumes);
  settings.aovs.erase(Aov::cost_primitives);
  return settings;
}

RenderContext context_for(const Settings& settings) {
  const auto scene = mixed_scene();
  const Plan plan = make_plan(*scene, mixed_camera(), settings);
  return {scene, make_accel(scene, plan.accel), settings, plan,
          CameraRays(mixed_camera(), settings.width, settings.height)};
}

std::vector<PixelRect> rects(const RenderContext& context) {
  std::vector<PixelRect> out;
  for (const Tile& tile : context.plan.tiling.tiles) out.push_back(tile.rect);
  return out;
}

/// How a pass's tiles are worked on.
struct Work {
  unsigned threads = 1;
  std::uint64_t order = 0;      ///< Seed of the order in which tiles are taken.
  bool first_try_lost = false;  ///< Each tile is rendered twice, and the first result thrown away.
};

struct Done {
  Pixels pixels;
  PassReport report;
};

void render_pass(const RenderContext& context, Passes& passes, Film& film, const Work& work) {
  const std::vector<Tile>& tiles = context.plan.tiling.tiles;
  std::vector<std::size_t> order(tiles.size());
  std::iota(order.begin(), order.end(), 0);
  Random random(work.order);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.bits() % i]);
  std::atomic<std::size_t> next{0};
  std::vector<std::jthread> pool;
  for (unsigned t = 0; t < work.threads; ++t)
    pool.emplace_back([&] {
      for (std::size_t i; (i = next++) < order.size();) {
        const std::size_t tile = order[i];
        const PixelRect rect = tiles[tile].rect;
        if (passes.current().samples_in(rect) == 0) continue;
        if (work.first_try_lost) render_tile(context, tile, passes.work(rect, film));
        const auto result = render_tile(context, tile, passes.work(rect, film));
        film.store(tile, result->pixels);
        passes.store(result->sums);
      }
    });
}

Done render(const Settings& settings, const Work& work = {}) {
  const RenderContext context = context_for(settings);
  Film film(settings.width, settings.height, settings.aovs, rects(context));
  Passes passes(settings);
  do render_pass(context, passes, film, work);
  while (passes.next(0));
  return {film.pixels(), passes.report()};
}

TEST(RenderInPasses, IsWhatOnePassGives) {
  for (const IntegratorKind integrator : {IntegratorKind::whitted, IntegratorKind::path}) {
    Settings settings = small(21);
    settings.integrator = integrator;
    const RenderContext context = context_for(settings);
    Film film(settings.width, settings.height, settings.aovs, rects(context));
    for (std::size_t i = 0; i < context.plan.tiling.tiles.size(); ++i) film.store(i, render_tile(context, i)->pixels);
    const Done passes = render(settings);
    EXPECT_TRUE(same_bytes(film.pixels(), passes.pixels));
    EXPECT_GT(passes.report.passes, 2U);
    EXPECT_EQ(passes.report.ended_by, EndedBy::samples);
  }
}

/// An image that is given up in the middle of each of its passes: what is left of it are tiles as they were stored.
Done render_given_up_everywhere(const Settings& settings) {
  const RenderContext context = context_for(settings);
  const std::vector<PixelRect> tiles = rects(context);
  auto passes = std::make_unique<Passes>(settings);
  auto film = std::make_unique<Film>(settings.width, settings.height, settings.aovs, tiles);
  const auto render_half = [&](std::size_t first) {
    for (std::size_t i = first; i < tiles.size(); i += 2) {
      if (passes->current().samples_in(tiles[i]) == 0) continue;
      const auto result = render_tile(context, i, passes->work(tiles[i], *film));
      film->store(i, result->pixels);
      passes->store(result->sums);
    }
  };
  do {
    render_half(0);
    auto again = std::make_unique<Passes>(settings, false, passes->current(), passes->report());
    auto again_film = std::make_unique<Film>(settings.width, settings.height, settings.aovs, tiles);
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      if (passes->report().passes == 0 && i % 2 == 1) continue;  // There is nothing of it.
      Pixels pixels(tiles[i], settings.aovs);
      pixels.copy(film->pixels(), tiles[i]);
      again_film->store(i, pixels);
      again->store(passes->sums(tiles[i]));
    }
    passes = std::move(again);
    film = std::move(again_film);
    render_half(1);
  } while (passes->next(0));
  return {film->pixels(), passes->report()};
}

TEST(RenderInPasses, GoesOnFromStoredTiles) {
  for (const bool measured : {false, true}) {
    Settings settings = small(measured ? 1 << 12 : 40);
    settings.integrator = IntegratorKind::path;
    if (measured) {
      settings.aovs = {Aov::sample_count, Aov::variance, Aov::albedo};
      settings.width = 96;
      settings.height = 80;
      settings.error = 0.03F;
    }
    const Done whole = render(settings), pieces = render_given_up_everywhere(settings);
    EXPECT_TRUE(same_bytes(whole.pixels, pieces.pixels)) << measured;
    EXPECT_GT(pieces.report.passes, 2U);
    EXPECT_EQ(pieces.report.passes, whole.report.passes);
    EXPECT_EQ(pieces.report.samples, whole.report.samples);
    EXPECT_EQ(pieces.report.ended_by, whole.report.ended_by);
    if (measured) {
      EXPECT_EQ(pieces.report.error->high, whole.report.error->high);
    }
  }
}

TEST(RenderInPasses, RecordsHowOftenAndHowWell) {
  const Pixels p = render(small(16)).pixels;
  for (const std::uint32_t n : p.plane<std::uint32_t>(Aov::sample_count)) ASSERT_EQ(n, 16U);
  const auto& alpha = p.plane<float>(Aov::alpha);
  const auto& variance = p.plane<Rgb>(Aov::variance);
  const auto& depth = p.plane<float>(Aov::depth);
  float greatest = 0;
  for (std::size_t i = 0; i < alpha.size(); ++i) {
    EXPECT_GE(alpha[i], depth[i] < kInfinity ? 1 / 16.0F : 0);
    EXPECT_LE(alpha[i], 1);
    if (alpha[i] == 0) {
      EXPECT_EQ(variance[i], Rgb()) << "background has no noise";
    }
    greatest = std::max(greatest, variance[i].r);
  }
  EXPECT_GT(greatest, 0);
}

/// Of every way of sharing it out, and of any structure, there is one image that has the error that was asked for.
TEST(RenderInPasses, UntilAnErrorIsOneImage_Stress52_Stress78) {
  Settings settings = small(1 << 12);
  settings.aovs = {Aov::sample_count};
  settings.integrator = IntegratorKind::path;
  settings.width = 96;  // As many pixels as make a few samples of each enough for their errors to be believed.
  settings.height = 80;
  settings.error = 0.03F;
  const Done reference = render(settings);
  EXPECT_EQ(reference.report.ended_by, EndedBy::error);
  EXPECT_LE(reference.report.error->high, 0.03F);
  const auto& counts = reference.pixels.plane<std::uint32_t>(Aov::sample_count);
  EXPECT_NE(*std::ranges::min_element(counts), *std::ranges::max_element(counts)) << "samples went where they were due";
  EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}), reference.report.samples);
  struct Way {
    std::uint32_t tile_size;
    AccelKind accel;
    Work work;
  };
  for (const Way& way : {Way{1, AccelKind::grid, {3, 1, false}}, Way{7, AccelKind::bvh, {1, 2, true}},
                         Way{16, AccelKind::kd, {8, 3, false}}, Way{64, AccelKind::wide, {2, 4, false}}}) {
    settings.tile_size = way.tile_size;
    settings.accel.kind = way.accel;
    const Done other = render(settings, way.work);
    EXPECT_TRUE(same_bytes(reference.pixels, other.pixels)) << "tiles of " << way.tile_size;
    EXPECT_EQ(other.report.samples, reference.report.samples);
    EXPECT_EQ(other.report.passes, reference.report.passes);
    EXPECT_EQ(other.report.error->error, reference.report.error->error);
  }
}

/// Stopped in the middle of any pass, with what is between passes kept, and resumed in another context.
TEST(RenderInPasses, StoppedAndResumedIsOneImage_Stress53_Stress77) {
  for (const bool measured : {false, true}) {
    Settings settings = small(measured ? 100 : 40);
    settings.integrator = IntegratorKind::path;
    if (measured) settings.error = 0.01F;
    const Done reference = render(settings);
    for (std::uint32_t stop_after = 0; stop_after < reference.report.passes; ++stop_after) {
      const RenderContext before = context_for(settings);
      Film film(settings.width, settings.height, settings.aovs, rects(before));
      Passes passes(settings);
      for (std::uint32_t pass = 0; pass < stop_after; ++pass) {
        render_pass(before, passes, film, {2, stop_after});
        passes.next(0);
      }
      std::stop_source stop;
      stop.request_stop();
      TileRenderer begun(before, 0, passes.work(before.plan.tiling.tiles[0].rect, film));
      EXPECT_FALSE(begun.go_on([&] { return stop.stop_requested(); }));

      Passes kept = passes;
      const RenderContext after = context_for(settings);
      Film resumed(settings.width, settings.height, settings.aovs, rects(after));
      if (stop_after > 0)
        for (std::size_t i = 0; i < after.plan.tiling.tiles.size(); ++i) {
          Pixels tile(after.plan.tiling.tiles[i].rect, settings.aovs);
          tile.copy(film.pixels(), tile.rect);
          resumed.store(i, tile);
        }
      do render_pass(after, kept, resumed, {3, stop_after + 99});
      while (kept.next(0));
      EXPECT_TRUE(same_bytes(reference.pixels, resumed.pixels())) << "stopped after " << stop_after << " passes";
      EXPECT_EQ(kept.report().samples, reference.report.samples);
    }
  }
}

}  // namespace
}  // namespace tessera

#include "core/screen/tiling.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "core/screen/screen_rect.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

Tiling tiling(const Scene& scene, const Camera& camera, const Settings& s) {
  return make_tiling(scene, CameraRays(camera, s.width, s.height), s);
}

TEST(Tiling, CoversEveryPixelOnce) {
  const auto scene = mixed_scene();
  Settings settings;
  settings.width = 101;
  settings.height = 67;
  for (const ScreenBounds bounds : {ScreenBounds::off, ScreenBounds::flat})
    for (const std::uint32_t size : {kAdaptiveTiles, 1U, 7U, 64U, 200U}) {
      settings.tile_size = size;
      settings.screen_bounds = bounds;
      std::vector<int> covered(101 * 67);
      for (const Tile& tile : tiling(*scene, mixed_camera(), settings).tiles) {
        if (size != kAdaptiveTiles) {
          EXPECT_EQ(tile.rect.x0 % static_cast<int>(size), 0) << "a grid";
          EXPECT_EQ(tile.rect.y0 % static_cast<int>(size), 0);
          EXPECT_LE(tile.rect.width(), static_cast<int>(size));
        }
        for (int y = tile.rect.y0; y < tile.rect.y1; ++y)
          for (int x = tile.rect.x0; x < tile.rect.x1; ++x) ++covered[static_cast<std::size_t>(y * 101 + x)];
      }
      EXPECT_TRUE(std::ranges::all_of(covered, [](int n) { return n == 1; })) << size;
    }
}

TEST(Tiling, GivesEveryTileTheObjectsThatProjectIntoIt) {
  const auto scene = mixed_scene();
  Settings settings;
  settings.width = settings.height = 128;
  const CameraRays camera(mixed_camera(), 128, 128);
  const Tiling cut = make_tiling(*scene, camera, settings);
  bool any_list = false;
  for (const Tile& tile : cut.tiles) {
    const auto listed = cut.candidates_of(tile);
    std::vector<std::uint32_t> expected;
    for (std::uint32_t i = 0; i < scene->objects.size(); ++i) {
      const Object& o = scene->objects[i];
      const PixelRect area =
          screen_rect(world_bounds(*scene, o), camera, o.placement ? o.placement->error() : Transform::Error{});
      if (overlap(area, tile.rect)) expected.push_back(i);
    }
    if (tile.first_level == FirstLevel::nothing) {
      EXPECT_TRUE(expected.empty());
    }
    if (tile.first_level == FirstLevel::candidates) {
      any_list = true;
      EXPECT_TRUE(std::ranges::equal(listed, expected));
    }
  }
  EXPECT_TRUE(any_list);
}

TEST(Tiling, FollowsWhatIsInIt) {
  Settings settings;
  settings.width = settings.height = 512;
  const Tiling cut = tiling(*sparse_scene(), mixed_camera(), settings);
  std::int64_t empty = 0, smallest = 1 << 30, largest = 0;
  for (const Tile& tile : cut.tiles) {
    if (tile.first_level == FirstLevel::nothing) empty += tile.rect.area();
    smallest = std::min(smallest, tile.rect.area());
    largest = std::max(largest, tile.rect.area());
  }
  EXPECT_GT(empty, 512 * 512 * 3 / 4);
  EXPECT_LT(smallest * 16, largest);
  EXPECT_LT(cut.tiles.size(), 64U) << "emptiness isn't cut up";
}

TEST(Tiling, OfAnEmptySceneIsOneTileThatNeedsNothing) {
  const auto scene = SceneBuilder().build();
  const Tiling cut = tiling(*scene, mixed_camera(), Settings{});
  ASSERT_EQ(cut.tiles.size(), 1U);
  EXPECT_EQ(cut.tiles[0].first_level, FirstLevel::nothing);
}

}  // namespace
}  // namespace tessera

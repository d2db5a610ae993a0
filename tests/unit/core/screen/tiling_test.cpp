#include "core/screen/tiling.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "core/screen/screen_rect.h"
#include "tests/support/scenes.h"

namespace tessera {
namespace {

TEST(Tiling, CoversEveryPixelOnce) {
  const auto scene = mixed_scene();
  Settings settings;
  settings.width = 101;
  settings.height = 67;
  for (const ScreenBounds bounds : {ScreenBounds::off, ScreenBounds::flat, ScreenBounds::hierarchical})
    for (const std::uint32_t size : {kAdaptiveTiles, 1U, 7U, 64U, 200U}) {
      settings.tile_size = size;
      settings.screen_bounds = bounds;
      std::vector<int> covered(101 * 67);
      for (const Tile& tile : make_tiling(*scene, mixed_camera(), settings).tiles) {
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
  const Tiling cut = make_tiling(*scene, mixed_camera(), settings);
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
  const Tiling cut = make_tiling(*sparse_scene(), mixed_camera(), settings);
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

TEST(Tiling, OfPartsListsNoMoreThanOfWholeObjects) {
  const auto scene = mixed_scene();
  Settings settings;
  settings.width = settings.height = 128;
  for (const std::uint32_t size : {1U, 4U}) {
    settings.tile_size = size;
    settings.screen_bounds = ScreenBounds::flat;
    const Tiling flat = make_tiling(*scene, mixed_camera(), settings);
    settings.screen_bounds = ScreenBounds::hierarchical;
    const Tiling parts = make_tiling(*scene, mixed_camera(), settings);
    ASSERT_EQ(flat.tiles.size(), parts.tiles.size());
    std::size_t fewer = 0;
    for (std::size_t i = 0; i < flat.tiles.size(); ++i) {
      ASSERT_EQ(flat.tiles[i].rect, parts.tiles[i].rect);
      ASSERT_NE(flat.tiles[i].first_level, FirstLevel::structure) << "or there is nothing to compare";
      const auto whole = flat.candidates_of(flat.tiles[i]), listed = parts.candidates_of(parts.tiles[i]);
      EXPECT_TRUE(std::ranges::includes(whole, listed));
      fewer += whole.size() - listed.size();
    }
    EXPECT_GT(fewer, 0U) << "tiles beside the instances' silhouettes";
  }
}

TEST(Tiling, FollowsTheSilhouetteOfAMesh) {
  // A thin bar along the picture's diagonal: its rectangle is the picture, most of which it leaves free.
  TriangleMesh bar;
  for (int i = 0; i <= 2000; ++i) {
    const float at = static_cast<float>(i) * 0.002F - 2;
    bar.positions.push_back({at, at + 0.02F, 0});
    bar.positions.push_back({at, at - 0.02F, 0});
  }
  for (std::uint32_t i = 0; i + 2 < bar.positions.size(); ++i) bar.triangles.push_back({i, i + 1, i + 2});
  const auto scene = SceneBuilder().add(bar).build();
  const Camera camera = OrthographicCamera{{{0, 0, 5}, {0, 0, 0}, {0, 1, 0}}, 4};
  Settings settings;
  const auto empty = [&](ScreenBounds bounds) {
    settings.screen_bounds = bounds;
    std::int64_t pixels = 0;
    for (const Tile& tile : make_tiling(*scene, camera, settings).tiles)
      if (tile.first_level == FirstLevel::nothing) pixels += tile.rect.area();
    return pixels;
  };
  EXPECT_EQ(empty(ScreenBounds::flat), 0);
  EXPECT_GT(empty(ScreenBounds::hierarchical), 512 * 512 * 4 / 5);
}

TEST(Tiling, CountsObjectsOfWhichNoPartIsSeen) {
  // An L around the picture, in its rectangle but out of its sight.
  TriangleMesh bars;
  for (int i = 0; i < 400; ++i) {
    const auto next = static_cast<std::uint32_t>(bars.positions.size());
    const float at = static_cast<float>(i % 200) * 0.05F - 5;
    const Vec3 p = i < 200 ? Vec3{at, -4.9F, 0} : Vec3{-4.9F, at, 0};
    bars.positions.insert(bars.positions.end(), {p, p + Vec3{0.1F, 0, 0}, p + Vec3{0, 0.1F, 0}});
    bars.triangles.push_back({next, next + 1, next + 2});
  }
  const auto scene = SceneBuilder().add(bars).build();
  const Camera camera = OrthographicCamera{{{0, 0, 5}, {0, 0, 0}, {0, 1, 0}}, 4};
  Settings settings;
  EXPECT_EQ(make_tiling(*scene, camera, settings).objects_on_screen, 1U);
  settings.screen_bounds = ScreenBounds::hierarchical;
  const Tiling parts = make_tiling(*scene, camera, settings);
  EXPECT_EQ(parts.objects_on_screen, 0U);
  EXPECT_EQ(parts.tiles.size(), 1U);
}

TEST(Tiling, OfAnEmptySceneIsOneTileThatNeedsNothing) {
  const auto scene = SceneBuilder().build();
  const Tiling cut = make_tiling(*scene, mixed_camera(), Settings{});
  ASSERT_EQ(cut.tiles.size(), 1U);
  EXPECT_EQ(cut.tiles[0].first_level, FirstLevel::nothing);
}

}  // namespace
}  // namespace tessera

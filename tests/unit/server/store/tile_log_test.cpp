#include "server/store/tile_log.h"

#include <filesystem>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/image.h"
#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {

const std::vector<PixelRect> kTiles{{0, 0, 20, 24}, {20, 0, 40, 24}};

Settings logged_settings() {
  Settings settings;
  settings.width = 40;
  settings.height = 24;
  settings.samples = 40;
  settings.aovs = {Aov::depth, Aov::variance, Aov::albedo};
  settings.error = 0.1F;
  return settings;
}

/// An image in passes whose tiles are logged, each with values that only it and its pass have.
struct Logged {
  explicit Logged(std::filesystem::path folder) : log(std::move(folder), settings, kTiles) {}

  void begin() {
    StoredPasses at{passes.report().passes, 1.5 * passes.report().passes, {}, passes.current(), {}, {}};
    at.figures.samples = passes.report().samples;
    at.figures.passes = passes.report();
    log.begin(at, passes, film);
  }
  void store(std::size_t tile) {
    Pixels pixels(kTiles[tile], settings.aovs);
    Sums sums(kTiles[tile], settings);
    const float value = static_cast<float>(passes.report().passes) * 10 + static_cast<float>(tile);
    for (std::size_t i = 0; i < pixels.color.size(); ++i) {
      pixels.color[i] = {value, static_cast<float>(i), 0};
      pixels.record(Aov::depth, i, value + 1);
      sums.totals.color[i] = {value, value, static_cast<float>(i)};
      sums.second[i] = {value + 2, value, 0};
      sums.mean[i] = {value, 0, 0};
      sums.squares[i] = {0, value, 0};
    }
    film.store(tile, pixels);
    passes.store(sums);
    Progress::Done done;
    done.samples = 100 + tile;
    log.add(tile, pixels, sums, done);
  }
  /// Whether tile `index` of what was loaded is as it is here.
  bool is_here(const StoredPasses& stored, std::size_t index) const {
    Pixels pixels(kTiles[index], settings.aovs);
    pixels.copy(film.pixels(), kTiles[index]);
    const Sums sums = passes.sums(kTiles[index]);
    const StoredTile& tile = *stored.tiles.at(index);
    return same_bytes(tile.pixels, pixels) && tile.sums.second == sums.second && tile.sums.squares == sums.squares &&
           same_bytes(tile.sums.totals, sums.totals);
  }

  Settings settings = logged_settings();
  Passes passes{settings};
  Film film{settings.width, settings.height, settings.aovs, kTiles};
  TileLog log;
};

std::optional<StoredPasses> load(const std::filesystem::path& folder) {
  return TileLog(folder, logged_settings(), kTiles).load();
}

TEST(TileLog, HasTheTilesOfTheFirstPass) {
  const TemporaryFolder root;
  const auto folder = root.path() / "job";
  EXPECT_FALSE(load(folder));
  Logged logged(folder);
  logged.begin();
  EXPECT_FALSE(std::filesystem::exists(folder)) << "there is nothing to be kept";
  logged.store(1);
  const auto stored = load(folder);
  ASSERT_TRUE(stored);
  EXPECT_EQ(stored->pass, 0U);
  EXPECT_FALSE(stored->tiles[0]);
  EXPECT_TRUE(logged.is_here(*stored, 1));
  EXPECT_EQ(stored->is_done, (std::vector{false, true}));
  EXPECT_EQ(stored->tiles[1]->done.samples, 101U);
}

TEST(TileLog, GoesOnInTheLastPass) {
  const TemporaryFolder root;
  const auto folder = root.path() / "job";
  Logged logged(folder);
  for (int pass = 0; pass < 3; ++pass) {
    logged.begin();
    logged.store(0);
    logged.store(1);
    ASSERT_TRUE(logged.passes.next(0));
  }
  logged.begin();
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 2) << "older files aren't needed";
  auto stored = load(folder);
  ASSERT_TRUE(stored);
  EXPECT_EQ(stored->is_done, (std::vector{false, false}));
  logged.store(1);
  stored = load(folder);
  ASSERT_TRUE(stored);
  EXPECT_EQ(stored->pass, 3U);
  EXPECT_EQ(stored->seconds, 4.5);
  EXPECT_EQ(stored->figures.samples, logged.passes.report().samples);
  EXPECT_EQ(stored->figures.passes.passes, 3U);
  EXPECT_EQ(stored->current.blocks, logged.passes.current().blocks);
  EXPECT_EQ(stored->is_done, (std::vector{false, true}));
  EXPECT_TRUE(logged.is_here(*stored, 0));
  EXPECT_TRUE(logged.is_here(*stored, 1));
}

TEST(TileLog, ATornRecordIsCutOff) {
  const TemporaryFolder root;
  const auto folder = root.path() / "job", file = folder / "0.tiles";
  std::uintmax_t one = 0;
  {
    Logged logged(folder);
    logged.begin();
    logged.store(0);
    one = std::filesystem::file_size(file);
    logged.store(1);
  }
  const auto two = std::filesystem::file_size(file);
  for (const std::uintmax_t size : {two - 1, one + 1}) {
    std::filesystem::resize_file(file, size);
    const auto stored = load(folder);
    ASSERT_TRUE(stored);
    EXPECT_TRUE(stored->tiles[0]);
    EXPECT_FALSE(stored->tiles[1]);
    EXPECT_EQ(std::filesystem::file_size(file), one) << "what is added next stands behind what is whole";
  }
  std::filesystem::resize_file(file, 3);
  EXPECT_FALSE(load(folder));
  EXPECT_FALSE(std::filesystem::exists(folder));
}

TEST(TileLog, IsNoneOfAnotherImage) {
  const TemporaryFolder root;
  const auto folder = root.path() / "job";
  {
    Logged logged(folder);
    logged.begin();
    logged.store(0);
  }
  EXPECT_FALSE(TileLog(folder, logged_settings(), {{0, 0, 40, 24}}).load());
  EXPECT_FALSE(std::filesystem::exists(folder));
}

TEST(TileLog, WritesDownAllOnceItIsWorthIt) {
  const TemporaryFolder root;
  const auto folder = root.path() / "job";
  Logged logged(folder);
  logged.begin();
  logged.store(0);
  logged.log.skip();
  EXPECT_FALSE(std::filesystem::exists(folder));
  logged.store(1);
  ASSERT_TRUE(logged.passes.next(0));
  logged.begin();
  logged.store(1);
  const auto stored = load(folder);
  ASSERT_TRUE(stored);
  EXPECT_EQ(stored->pass, 1U);
  EXPECT_TRUE(logged.is_here(*stored, 0));
  EXPECT_TRUE(logged.is_here(*stored, 1));
  EXPECT_EQ(stored->is_done, (std::vector{false, true}));
  logged.log.remove();
  EXPECT_FALSE(std::filesystem::exists(folder));
}

}  // namespace
}  // namespace tessera::server

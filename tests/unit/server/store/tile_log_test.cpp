#include "server/store/tile_log.h"

#include <filesystem>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/image.h"
#include "tests/support/logged_tiles.h"
#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {

/// Whether tile `index` of what was loaded is as it was logged.
bool is_there(const Logged& logged, const StoredPasses& stored, std::size_t index) {
  Pixels pixels(kTiles[index], logged.settings.aovs);
  pixels.copy(logged.film.pixels(), kTiles[index]);
  const Sums sums = logged.passes.sums(kTiles[index]);
  const StoredTile& tile = *stored.tiles.at(index);
  return same_bytes(tile.pixels, pixels) && tile.sums.second == sums.second && tile.sums.squares == sums.squares &&
         same_bytes(tile.sums.totals, sums.totals);
}

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
  EXPECT_TRUE(is_there(logged, *stored, 1));
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
  EXPECT_TRUE(is_there(logged, *stored, 0));
  EXPECT_TRUE(is_there(logged, *stored, 1));
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
  EXPECT_TRUE(is_there(logged, *stored, 0));
  EXPECT_TRUE(is_there(logged, *stored, 1));
  EXPECT_EQ(stored->is_done, (std::vector{false, true}));
  logged.log.remove();
  EXPECT_FALSE(std::filesystem::exists(folder));
}

}  // namespace
}  // namespace tessera::server

#include "server/store/tombstones.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {

TEST(Tombstones, OutliveTheProcess) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "gone";
  {
    Tombstones stones(file);
    stones.add("a", Fate::expired);
    stones.add("b", Fate::damaged);
    stones.add("c", Fate::expired);
    stones.remove("c");
    stones.remove("d");
    stones.add("a", Fate::damaged);
  }
  const Tombstones stones(file);
  EXPECT_EQ(stones.find("a"), Fate::damaged);
  EXPECT_EQ(stones.find("b"), Fate::damaged);
  EXPECT_EQ(stones.find("c"), std::nullopt);
  EXPECT_EQ(stones.find("d"), std::nullopt);
}

TEST(Tombstones, AreOfTheLastFew) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "gone";
  {
    Tombstones stones(file, 3);
    for (int i = 0; i < 100; ++i) stones.add("name" + std::to_string(i), Fate::expired);
    EXPECT_EQ(stones.find("name96"), std::nullopt);
    EXPECT_EQ(stones.find("name97"), Fate::expired);
  }
  EXPECT_LT(std::filesystem::file_size(file), 100U) << "it is written anew before it gets long";
  const Tombstones again(file, 3);
  EXPECT_EQ(again.find("name96"), std::nullopt);
  for (const char* name : {"name97", "name98", "name99"}) EXPECT_EQ(again.find(name), Fate::expired);
}

TEST(Tombstones, DoWithoutADisk) {
  Tombstones stones("/nonexistent/gone");
  stones.add("a", Fate::expired);
  EXPECT_EQ(stones.find("a"), Fate::expired);
  const TemporaryFolder folder;
  folder.write("gone", std::string("-\n\n?x\n-a\nb\0\n-", 13));
  const Tombstones damaged(folder.path() / "gone");
  EXPECT_EQ(damaged.find("a"), Fate::expired);
  EXPECT_EQ(damaged.find("x"), std::nullopt);
}

}  // namespace
}  // namespace tessera::server

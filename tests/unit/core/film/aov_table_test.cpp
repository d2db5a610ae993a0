#include "core/film/aov_table.h"

#include <set>
#include <string>

#include <gtest/gtest.h>

#include "core/film/pixels.h"
#include "core/math/rounding.h"

namespace tessera {
namespace {

/// Channels of a value.
std::size_t channels_of(const PlaneValue& value) {
  return std::visit([](auto v) { return sizeof v / sizeof(float); }, value);
}

TEST(AovTable, NamesEveryChannelOnce) {
  std::set<std::string_view> names{"R", "G", "B", "all", ""}, channels{"R", "G", "B"};
  for (const AovEntry& row : aov_table()) {
    EXPECT_TRUE(names.insert(row.name).second) << row.name;
    std::size_t named = 0;
    for (const std::string_view channel : row.channels) {
      if (channel.empty()) continue;
      ++named;
      EXPECT_TRUE(channels.insert(channel).second) << channel;
    }
    EXPECT_EQ(named, channels_of(row.empty)) << row.name;
  }
}

/// Sums begin at the empty value.
TEST(AovTable, MeansBeginWithNothing) {
  for (const AovEntry& row : aov_table()) {
    if (row.origin != AovOrigin::mean) continue;
    std::visit([](auto empty) { EXPECT_EQ(empty, decltype(empty){}); }, row.empty);
  }
}

TEST(Pixels, HaveAPlaneForEveryRowThatIsAskedFor) {
  std::set<Aov> all;
  for (const AovEntry& row : aov_table()) {
    const Pixels one({2, 1, 5, 3}, {row.aov});
    EXPECT_EQ(one.aovs(), std::set<Aov>{row.aov});
    std::visit(
        [&]<typename T>(const std::vector<T>& values) {
          EXPECT_EQ(values, std::vector<T>(6, std::get<T>(row.empty))) << row.name;
        },
        one.values(row.aov));
    EXPECT_EQ(Pixels::bytes_per_pixel({row.aov}), sizeof(Rgb) + 4 * channels_of(row.empty)) << row.name;
    all.insert(row.aov);
  }
  const Pixels none({0, 0, 1, 1}, {});
  for (const Aov aov : all) std::visit([](const auto& values) { EXPECT_TRUE(values.empty()); }, none.values(aov));
}

TEST(Pixels, CopyARectangleOfEveryPlane) {
  const std::set<Aov> aovs{Aov::depth, Aov::object_id, Aov::albedo, Aov::position};
  Pixels tile({2, 1, 4, 3}, aovs), image({0, 0, 5, 4}, aovs);
  const std::size_t from = tile.index(3, 2), to = image.index(3, 2);
  tile.color[from] = {1, 2, 3};
  tile.record(Aov::depth, from, 4.0F);
  tile.record(Aov::object_id, from, std::uint32_t{5});
  tile.record(Aov::albedo, from, Rgb{6, 7, 8});
  tile.record(Aov::position, from, Vec3{9, 10, 11});
  tile.record(Aov::normal, from, Vec3{1, 1, 1});  // not recorded: nothing happens
  image.copy(tile, tile.rect);
  EXPECT_EQ(image.color[to], (Rgb{1, 2, 3}));
  EXPECT_EQ(image.plane<float>(Aov::depth)[to], 4);
  EXPECT_EQ(image.plane<std::uint32_t>(Aov::object_id)[to], 5U);
  EXPECT_EQ(image.plane<Rgb>(Aov::albedo)[to], (Rgb{6, 7, 8}));
  EXPECT_EQ(image.plane<Vec3>(Aov::position)[to], (Vec3{9, 10, 11}));
  EXPECT_EQ(image.plane<float>(Aov::depth)[image.index(1, 1)], kInfinity);
  EXPECT_EQ(image.color[image.index(4, 2)], Rgb());
}

}  // namespace
}  // namespace tessera

#include "core/film/film.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

TEST(Film, TakesTilesInAnyOrderAndShowsWhatIsThere) {
  const std::set<Aov> aovs{Aov::depth, Aov::object_id, Aov::cost_volumes, Aov::cost_primitives};
  const PixelRect left{0, 0, 2, 3}, right{2, 0, 5, 3};
  Film film(5, 3, aovs, {left, right});
  Pixels tile(right, aovs);
  tile.color[tile.index(4, 2)] = {1, 2, 3};
  tile.plane<float>(Aov::depth)[tile.index(2, 0)] = 7;
  tile.plane<float>(Aov::cost_volumes)[tile.index(3, 1)] = 2.5F;
  tile.plane<float>(Aov::cost_primitives)[tile.index(3, 1)] = 1.5F;
  film.store(1, tile);

  const Pixels& part = film.pixels();
  EXPECT_EQ(part.color[part.index(4, 2)], (Rgb{1, 2, 3}));
  EXPECT_EQ(part.plane<float>(Aov::depth)[part.index(2, 0)], 7);
  EXPECT_EQ(part.plane<float>(Aov::cost_volumes)[part.index(3, 1)], 2.5F);
  EXPECT_EQ(part.plane<float>(Aov::cost_primitives)[part.index(3, 1)], 1.5F);
  EXPECT_TRUE(part.plane<Vec3>(Aov::normal).empty()) << "not asked for";
  EXPECT_EQ(film.versions(), (std::vector<std::uint32_t>{0, 1}));

  const Film::Snapshot there = film.snapshot({Aov::depth});
  EXPECT_EQ(there.versions, film.versions());
  EXPECT_EQ(there.is_there, (std::vector<std::uint8_t>{0, 0, 1, 1, 1, 0, 0, 1, 1, 1, 0, 0, 1, 1, 1}));
  EXPECT_EQ(there.pixels.color, part.color);
  EXPECT_EQ(there.pixels.plane<float>(Aov::depth), part.plane<float>(Aov::depth));
  EXPECT_EQ(there.pixels.aovs(), std::set<Aov>{Aov::depth}) << "no more than is asked for";

  film.store(0, Pixels(left, aovs));
  tile.color[tile.index(4, 2)] = {4, 5, 6};
  film.store(1, tile);
  EXPECT_EQ(film.versions(), (std::vector<std::uint32_t>{1, 2}));
  EXPECT_EQ(film.pixels().color[film.pixels().index(4, 2)], (Rgb{4, 5, 6}));
  EXPECT_EQ(there.pixels.color[there.pixels.index(4, 2)], (Rgb{1, 2, 3})) << "as it was";
}

TEST(Film, TellsItsSizeBeforehand) {
  EXPECT_EQ(Film::memory_bytes(10, 10, {}), 1200U);
  EXPECT_EQ(Film::memory_bytes(10, 10, {Aov::cost_volumes, Aov::cost_primitives}), 2000U);
  EXPECT_EQ(Film::memory_bytes(1 << 20, 1 << 20, {Aov::normal, Aov::depth}), (1ULL << 40) * 28);
}

}  // namespace
}  // namespace tessera

#include "core/screen/screen_tree.h"

#include <set>

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace tessera {
namespace {

std::vector<ScreenPart> random_parts(Random& random, int count, std::int32_t side) {
  std::vector<ScreenPart> parts;
  const auto below = [&](std::int32_t n) {
    return static_cast<std::int32_t>(random.bits() % static_cast<unsigned>(n));
  };
  for (int i = 0; i < count; ++i) {
    const std::int32_t x = below(side), y = below(side);
    parts.push_back({{x, y, x + 1 + below(1 + side / 10), y + 1 + below(1 + side / 10)},
                     static_cast<std::uint32_t>(below(1 + count / 3))});
  }
  return parts;
}

TEST(ScreenTree, FindsTheObjectsOfAllPartsInARectangle) {
  for (int seed = 0; seed < 300; ++seed) {
    Random random(static_cast<std::uint64_t>(seed));
    const std::int32_t side = seed % 2 == 0 ? 100 : 1'000'000'000;
    const auto parts = random_parts(random, seed, side);
    const ScreenTree tree(parts);
    for (const ScreenPart& asked : random_parts(random, 20, side)) {
      std::set<std::uint32_t> expected;
      for (const ScreenPart& part : parts)
        if (overlap(part.area, asked.area)) expected.insert(part.object);
      const std::vector<std::uint32_t> all(expected.begin(), expected.end());
      ASSERT_EQ(tree.objects_in(asked.area, parts.size()), all) << "seed " << seed;
      ASSERT_EQ(tree.objects_in(asked.area, all.size()), all) << "seed " << seed;
      if (!all.empty()) {
        ASSERT_EQ(tree.objects_in(asked.area, all.size() - 1).size(), all.size()) << "seed " << seed;
      }
    }
  }
}

TEST(ScreenTree, BearsPartsInOnePlace) {
  std::vector<ScreenPart> parts;
  for (std::uint32_t i = 0; i < 100'000; ++i) {
    const auto grown = static_cast<std::int32_t>(i % 7);
    parts.push_back({{50 - grown, 50 - grown, 51 + grown, 51 + grown}, i});
  }
  const ScreenTree tree(parts);
  EXPECT_EQ(tree.objects_in({50, 50, 51, 51}, parts.size()).size(), parts.size());
  EXPECT_EQ(tree.objects_in({50, 50, 51, 51}, 3).size(), 4U);
  EXPECT_TRUE(tree.objects_in({0, 0, 40, 100}, 3).empty());
}

TEST(ScreenTree, WithoutPartsIsEmpty) {
  const ScreenTree tree({});
  EXPECT_TRUE(tree.objects_in({0, 0, 100, 100}, 3).empty());
  EXPECT_FALSE(tree.covers_half({0, 0, 100, 100}));
}

TEST(ScreenTree, KnowsWhatIsHalfCovered) {
  const PixelRect tile{100, 200, 164, 264};
  EXPECT_TRUE(ScreenTree({{tile, 0}}).covers_half(tile));
  EXPECT_TRUE(ScreenTree({{{0, 0, 132, 300}, 0}}).covers_half(tile)) << "the left half";
  EXPECT_FALSE(ScreenTree({{{0, 0, 124, 300}, 0}}).covers_half(tile)) << "three of eight columns";
  EXPECT_TRUE(ScreenTree({{{0, 0, 125, 300}, 0}}).covers_half(tile)) << "a cell that is overlapped counts";
  EXPECT_FALSE(ScreenTree({{{100, 200, 108, 208}, 0}, {{156, 256, 164, 264}, 1}}).covers_half(tile))
      << "two corners, whatever lies between";
  std::vector<ScreenPart> diagonal;
  for (std::int32_t i = 0; i < 64; ++i) diagonal.push_back({{100 + i, 200 + i, 101 + i, 201 + i}, 0});
  EXPECT_FALSE(ScreenTree(diagonal).covers_half(tile)) << "one mesh, seen along a diagonal";
  const PixelRect narrow{0, 0, 5, 9};
  EXPECT_TRUE(ScreenTree({{{0, 0, 5, 5}, 0}}).covers_half(narrow));
  EXPECT_FALSE(ScreenTree({{{0, 0, 1, 9}, 0}}).covers_half(narrow));
}

}  // namespace
}  // namespace tessera

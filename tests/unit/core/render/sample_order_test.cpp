#include "core/render/sample_order.h"

#include <algorithm>
#include <map>
#include <tuple>

#include <gtest/gtest.h>

namespace tessera {
namespace {

TEST(SampleOrder, HasEverySampleOnceAndAPixelsInOrder) {
  for (const PixelRect rect : {PixelRect{0, 0, 1, 1}, {3, 5, 40, 23}, {16, 0, 32, 16}, {7, 7, 8, 90}})
    for (const std::uint32_t samples : {1U, 3U, 16U}) {
      for (const auto& [most_samples, most_pixels] :
           {std::pair<std::size_t, std::size_t>{1024, 1024}, {5, 99}, {7, 1}}) {
        const Pass pass(90, 90, {2, samples});
        SampleOrder order(rect, pass);
        std::map<std::pair<std::int32_t, std::int32_t>, std::uint32_t> seen;
        std::vector<SampleId> some;
        while (order.next(most_samples, most_pixels, some)) {
          ASSERT_TRUE(!some.empty() && some.size() <= most_samples);
          std::size_t pixels = 0;
          for (std::size_t i = 0; i < some.size(); ++i) {
            ASSERT_EQ((2 + seen[{some[i].x, some[i].y}]++), some[i].index);
            pixels += i == 0 || some[i].x != some[i - 1].x || some[i].y != some[i - 1].y;
          }
          ASSERT_LE(pixels, most_pixels);
        }
        EXPECT_EQ(static_cast<std::int64_t>(seen.size()), rect.area());
        for (const auto& [at, count] : seen) {
          EXPECT_EQ(count, samples);
          EXPECT_TRUE(overlap(rect, {at.first, at.second, at.first + 1, at.second + 1}));
        }
      }
    }
}

TEST(SampleOrder, PartsHaveEverySampleOnceAndAreHalves) {
  for (const PixelRect rect : {PixelRect{0, 0, 1, 1}, {0, 0, 2, 1}, {3, 5, 40, 23}, {16, 0, 32, 16}, {7, 7, 8, 90}})
    for (const std::size_t begun : {std::size_t{0}, std::size_t{1}, std::size_t{50}}) {
      Pass pass(90, 90, {2, 8});
      pass.blocks[0] = pass.blocks[3] = {2, 0};
      pass.blocks[6] = {2, 100};
      std::map<std::tuple<std::int32_t, std::int32_t, std::uint32_t>, int> seen;
      std::vector<SampleId> some;
      const auto take = [&](SampleOrder& order, std::size_t most) {
        const bool is_more = order.next(most, 1000, some);
        for (const SampleId& s : some) ++seen[{s.x, s.y, s.index}];
        return is_more;
      };
      std::vector<SampleOrder> parts{SampleOrder(rect, pass)};
      if (begun > 0) take(parts[0], begun);
      const std::uint64_t all = pass.samples_in(rect), left = all - seen.size();
      for (std::size_t i = 0; i < parts.size(); ++i)
        while (auto rest = parts[i].split(10)) parts.push_back(*rest);
      EXPECT_TRUE(left <= 200 || parts.size() > 4);
      for (SampleOrder& part : parts)
        for (const std::size_t before = seen.size(); take(part, 7);) ASSERT_LE(seen.size() - before, left);
      EXPECT_EQ(seen.size(), all);
      for (const auto& [sample, count] : seen) ASSERT_EQ(count, 1);
    }
}

TEST(SampleOrder, GivesAwayNoMoreThanHalfAndNoLessThanAskedFor) {
  const Pass pass(64, 64, {0, 4});
  SampleOrder order({0, 0, 64, 64}, pass);
  std::vector<SampleId> some;
  std::uint64_t left = 64 * 64 * 4;
  while (auto rest = order.split(100)) {
    std::uint64_t given = 0;
    while (rest->next(1000, 1000, some)) given += some.size();
    EXPECT_GE(given, 100U);
    EXPECT_LE(given, left / 2);
    EXPECT_GT(given, left / 2 - 5) << "whole pixels";
    left -= given;
  }
  EXPECT_LT(left, 208U);
}

TEST(SampleOrder, LeavesOutBlocksThatAreFinished) {
  Pass pass(40, 40, {8, 2});
  pass.blocks[1] = {8, 0};
  pass.blocks[4] = {8, 5};
  for (const std::size_t most_pixels : {std::size_t{1}, std::size_t{1000}}) {
    SampleOrder order({5, 3, 37, 29}, pass);
    std::uint64_t all = 0;
    std::vector<SampleId> some;
    while (order.next(64, most_pixels, some)) {
      for (const SampleId& s : some) {
        const SampleRange& range = pass.of(s.x, s.y);
        EXPECT_TRUE(s.index >= range.first && s.index < range.end());
      }
      all += some.size();
    }
    EXPECT_EQ(all, 2U * (11 * 13 + 5 * 13 + 11 * 13 + 5 * 13) + 5U * 16 * 13);
    EXPECT_EQ(all, pass.samples_in({5, 3, 37, 29}));
  }
}

TEST(SampleOrder, KeepsNeighboursTogether) {
  const Pass pass(96, 80, {0, 1});
  SampleOrder order({32, 16, 96, 80}, pass);
  std::vector<SampleId> all;
  ASSERT_TRUE(order.next(64 * 64, 64 * 64, all));
  for (const auto& [count, side] : {std::pair<std::size_t, int>{16, 4}, {256, 16}})
    for (auto first = all.begin(); first != all.end(); first += static_cast<std::ptrdiff_t>(count)) {
      const auto last = first + static_cast<std::ptrdiff_t>(count);
      const auto [left, right] = std::minmax_element(first, last, [](auto& a, auto& b) { return a.x < b.x; });
      const auto [top, bottom] = std::minmax_element(first, last, [](auto& a, auto& b) { return a.y < b.y; });
      EXPECT_EQ(right->x - left->x, side - 1);
      EXPECT_EQ(bottom->y - top->y, side - 1);
    }
}

}  // namespace
}  // namespace tessera

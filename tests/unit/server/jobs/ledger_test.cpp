#include "server/jobs/ledger.h"

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

TEST(Ledger, BooksAsMuchAsThereIs) {
  Ledger ledger(100, {});
  auto first = ledger.book({"a", 50, 10});
  ASSERT_TRUE(first);
  EXPECT_EQ(ledger.booked(), 60U);
  EXPECT_FALSE(ledger.book({"b", 40, 1})) << "there is one byte too few";
  EXPECT_EQ(ledger.booked(), 60U) << "and nothing of it is booked";
  const auto second = ledger.book({"b", 40, 0});
  EXPECT_TRUE(second);
  first.reset();
  EXPECT_EQ(ledger.booked(), 40U);
}

TEST(Ledger, BooksOnceWhatIsShared) {
  Ledger ledger(100, {});
  auto first = ledger.book({"a", 50, 10}), second = ledger.book({"a", 50, 10});
  EXPECT_EQ(ledger.booked(), 70U);
  first.reset();
  EXPECT_EQ(ledger.booked(), 60U) << "the other one has it still";
  second.reset();
  EXPECT_EQ(ledger.booked(), 0U);
  EXPECT_TRUE(ledger.book({"a", 90, 10})) << "and it may be another the next time";
}

TEST(Ledger, TellsWhenThereIsRoomAgain) {
  Ledger ledger(100, {});
  std::vector<std::uint64_t> left;
  ledger.when_freed([&] { left.push_back(ledger.booked()); });  // No lock is held.
  auto job = ledger.book({"a", 40, 60});
  ASSERT_TRUE(job);
  EXPECT_TRUE(left.empty());
  job.reset();
  ASSERT_FALSE(left.empty());
  EXPECT_EQ(left.back(), 0U);
}

TEST(Ledger, CachesGiveWayInTheirOrder) {
  std::uint64_t structures = 30, scenes = 40;
  std::vector<std::pair<char, std::uint64_t>> shrunk;
  const auto cache = [&shrunk](char name, std::uint64_t& bytes) {
    return Ledger::Cache{[&bytes] { return bytes; },
                         [&shrunk, name, &bytes](std::uint64_t most) {
                           shrunk.emplace_back(name, most);
                           bytes = most;
                         }};
  };
  Ledger ledger(100, {cache('s', structures), cache('c', scenes)});
  const auto first = ledger.book({"a", 30, 0});
  EXPECT_TRUE(shrunk.empty()) << "there is room for all";
  const auto second = ledger.book({"b", 20, 0});
  EXPECT_EQ(shrunk, (std::vector<std::pair<char, std::uint64_t>>{{'s', 10}}));
  const auto third = ledger.book({"c", 30, 0});
  EXPECT_EQ(structures, 0U);
  EXPECT_EQ(scenes, 20U);
  const auto all = ledger.book({"d", 20, 0});
  ASSERT_TRUE(all);
  EXPECT_EQ(scenes, 0U) << "what jobs need is all there is";
}

}  // namespace
}  // namespace tessera::server

#include "server/scheduler.h"

#include <atomic>
#include <future>
#include <latch>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

using std::chrono::seconds;
constexpr seconds kLong{60};

TEST(Scheduler, RunsEveryUnitOnce) {
  constexpr int kBatches = 20, kUnits = 500;
  std::vector<std::atomic<int>> runs(kBatches * kUnits);
  std::latch left(kBatches * kUnits);
  Scheduler scheduler(4);
  for (int b = 0; b < kBatches; ++b)
    scheduler.submit(kUnits, [&, b](std::size_t i) {
      ++runs[b * kUnits + i];
      left.count_down();
    });
  left.wait();
  EXPECT_TRUE(scheduler.shut_down(kLong));
  for (const auto& count : runs) EXPECT_EQ(count, 1);
}

TEST(Scheduler, BatchesTakeTurns) {
  Scheduler scheduler(1);
  std::promise<void> go;
  std::latch left(7);
  std::string order;
  const auto add = [&](char name) {
    return [&, name](std::size_t) {
      order += name;
      left.count_down();
    };
  };
  scheduler.submit(1, [future = go.get_future().share()](std::size_t) { future.wait(); });
  scheduler.submit(4, add('a'));
  scheduler.submit(2, add('b'));
  scheduler.submit(1, add('c'));
  go.set_value();
  left.wait();
  EXPECT_TRUE(scheduler.shut_down(kLong));
  EXPECT_EQ(order, "abcabaa");
}

TEST(Scheduler, UnitsMaySubmitMore) {
  Scheduler scheduler(2);
  std::latch left(1 + 10 * 10);
  scheduler.submit(10, [&](std::size_t i) {
    scheduler.submit(10, [&](std::size_t) { left.count_down(); });
    if (i == 0) left.count_down();
  });
  left.wait();
  EXPECT_TRUE(scheduler.shut_down(kLong));
}

TEST(Scheduler, AStoppedBatchIsDropped) {
  Scheduler scheduler(1);
  std::stop_source stop;
  std::promise<void> done;
  std::atomic<int> runs = 0;
  scheduler.submit(
      1'000'000,
      [&](std::size_t) {
        if (++runs == 3) stop.request_stop();
      },
      stop.get_token());
  scheduler.submit(5, [&](std::size_t i) {
    if (i == 4) done.set_value();
  });
  done.get_future().wait();
  EXPECT_TRUE(scheduler.shut_down(kLong));
  EXPECT_EQ(runs, 3);
}

TEST(Scheduler, ADroppedBatchIsDestroyed) {
  const auto owned = std::make_shared<int>(1);
  std::stop_source stop;
  stop.request_stop();
  std::promise<void> done;
  Scheduler scheduler(1);
  scheduler.submit(
      9, [owned](std::size_t) {}, stop.get_token());
  scheduler.submit(1, [&](std::size_t) { done.set_value(); });
  done.get_future().wait();
  EXPECT_TRUE(scheduler.shut_down(kLong));
  EXPECT_EQ(owned.use_count(), 1);
}

TEST(Scheduler, ShuttingDownWaitsForWhatRunsAndNothingElse) {
  Scheduler scheduler(1);
  std::promise<void> begun, go;
  std::atomic<int> runs = 0;
  scheduler.submit(100, [&, future = go.get_future().share()](std::size_t i) {
    ++runs;
    if (i == 0) begun.set_value();
    future.wait();
  });
  begun.get_future().wait();
  EXPECT_FALSE(scheduler.shut_down(seconds(0)));
  go.set_value();
  EXPECT_TRUE(scheduler.shut_down(kLong));
  EXPECT_EQ(runs, 1);
  scheduler.submit(1, [&](std::size_t) { ++runs; });
  EXPECT_TRUE(scheduler.shut_down(kLong));
  EXPECT_EQ(runs, 1);
}

}  // namespace
}  // namespace tessera::server

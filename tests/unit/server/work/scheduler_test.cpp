#include "server/work/scheduler.h"

#include <atomic>
#include <future>
#include <latch>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

using std::chrono::seconds;
constexpr seconds kLong{60};

/// A unit that is at work until `go` is set.
Scheduler::Unit wait_for(std::promise<void>& go) {
  return [future = go.get_future().share()](std::size_t) {
    future.wait();
    return true;
  };
}

TEST(Scheduler, RunsEveryUnitOnce) {
  constexpr int kBatches = 20, kUnits = 500;
  std::vector<std::atomic<int>> runs(kBatches * kUnits);
  std::latch left(kBatches * kUnits);
  Scheduler scheduler(4);
  for (int b = 0; b < kBatches; ++b)
    scheduler.submit(kUnits, [&, b](std::size_t i) {
      ++runs[b * kUnits + i];
      left.count_down();
      return true;
    });
  left.wait();
  EXPECT_TRUE(scheduler.shut_down(kLong));
  for (const auto& count : runs) EXPECT_EQ(count, 1);
}

TEST(Scheduler, BatchesTakeTurns) {
  Scheduler scheduler(1, kLong);
  std::promise<void> go;
  std::latch left(7);
  std::string order;
  const auto add = [&](char name) {
    return [&, name](std::size_t) {
      order += name;
      left.count_down();
      return true;
    };
  };
  scheduler.submit(1, wait_for(go));
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
    scheduler.submit(10, [&](std::size_t) {
      left.count_down();
      return true;
    });
    if (i == 0) left.count_down();
    return true;
  });
  left.wait();
  EXPECT_TRUE(scheduler.shut_down(kLong));
}

TEST(Scheduler, AStoppedBatchIsDropped) {
  Scheduler scheduler(1, kLong);
  std::stop_source stop;
  std::promise<void> done;
  std::atomic<int> runs = 0;
  scheduler.submit(
      1'000'000,
      [&](std::size_t) {
        if (++runs == 3) stop.request_stop();
        return true;
      },
      stop.get_token());
  scheduler.submit(5, [&](std::size_t i) {
    if (i == 4) done.set_value();
    return true;
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
  Scheduler scheduler(1, kLong);
  scheduler.submit(
      9, [owned](std::size_t) { return true; }, stop.get_token());
  scheduler.submit(1, [&](std::size_t) {
    done.set_value();
    return true;
  });
  done.get_future().wait();
  EXPECT_TRUE(scheduler.shut_down(kLong));
  EXPECT_EQ(owned.use_count(), 1);
}

TEST(Scheduler, ShuttingDownWaitsForWhatRunsAndNothingElse) {
  Scheduler scheduler(1, kLong);
  std::promise<void> begun, go;
  std::atomic<int> runs = 0;
  scheduler.submit(100, [&, future = go.get_future().share()](std::size_t i) {
    ++runs;
    if (i == 0) begun.set_value();
    future.wait();
    return true;
  });
  begun.get_future().wait();
  EXPECT_FALSE(scheduler.shut_down(seconds(0)));
  go.set_value();
  EXPECT_TRUE(scheduler.shut_down(kLong));
  EXPECT_EQ(runs, 1);
  scheduler.submit(1, [&](std::size_t) {
    ++runs;
    return true;
  });
  EXPECT_TRUE(scheduler.shut_down(kLong));
  EXPECT_EQ(runs, 1);
}

TEST(Scheduler, StepsAreTurnsAndGoBeforeNewUnits) {
  Scheduler scheduler(1, kLong);
  std::promise<void> go;
  std::latch left(3 + 2 + 4);
  std::string order;
  const auto add = [&](char name, int steps) {
    return [&, name, steps, done = std::vector<int>(2)](std::size_t i) mutable {
      order += name + std::to_string(i) + ' ';
      const bool is_done = ++done[i] == steps;
      left.count_down();
      return is_done;
    };
  };
  scheduler.submit(1, wait_for(go));
  scheduler.submit(1, add('a', 3));
  scheduler.submit(2, add('b', 1));
  scheduler.submit(2, add('c', 2));
  go.set_value();
  left.wait();
  EXPECT_TRUE(scheduler.shut_down(kLong));
  EXPECT_EQ(order, "a0 b0 c0 a0 b1 c0 a0 c1 c1 ");
}

TEST(Scheduler, NoMoreUnitsAreBegunThanThreadsAreAtWork) {
  constexpr std::size_t kUnits = 100;
  constexpr unsigned kThreads = 3;
  Scheduler scheduler(kThreads, kLong);
  std::vector<std::atomic<int>> steps(kUnits);
  std::atomic<unsigned> open = 0, most_open = 0;
  std::latch left(kUnits);
  scheduler.submit(kUnits, [&](std::size_t i) {
    const int step = ++steps[i];
    if (step == 1) {
      const unsigned now = ++open;
      for (unsigned most = most_open; most < now && !most_open.compare_exchange_weak(most, now);) {
      }
    }
    if (step < 50) return false;
    --open;
    left.count_down();
    return true;
  });
  left.wait();
  EXPECT_TRUE(scheduler.shut_down(kLong));
  EXPECT_LE(most_open, kThreads);
  for (const auto& count : steps) EXPECT_EQ(count, 50);
}

TEST(Scheduler, AStopDropsUnitsBetweenTwoSteps) {
  const auto owned = std::make_shared<int>(1);
  std::stop_source stop;
  std::promise<void> done;
  int steps = 0, steps_after = 0;
  Scheduler scheduler(1, kLong);
  scheduler.submit(
      1,
      [&, owned](std::size_t) {
        if (++steps == 3) stop.request_stop();
        return false;
      },
      stop.get_token());
  scheduler.submit(1, [&](std::size_t) {
    if (!stop.stop_requested() || ++steps_after < 2) return false;  // By the second one, all have had a turn.
    done.set_value();
    return true;
  });
  done.get_future().wait();
  EXPECT_EQ(owned.use_count(), 1);
  EXPECT_EQ(steps, 3);
}

TEST(Scheduler, ShutsDownBetweenTwoSteps) {
  const auto owned = std::make_shared<int>(1);
  {
    Scheduler scheduler(2);
    std::latch begun(1);
    std::atomic_flag first;
    scheduler.submit(5, [&, owned](std::size_t) {
      if (!first.test_and_set()) begun.count_down();
      return false;
    });
    begun.wait();
    EXPECT_TRUE(scheduler.shut_down(kLong));
  }
  EXPECT_EQ(owned.use_count(), 1);
}

TEST(Scheduler, LongStepsDontHoldUpOthers) {
  Scheduler scheduler(2, std::chrono::milliseconds(1));
  std::promise<void> go;
  std::latch left(100 + 1);
  scheduler.submit(2, wait_for(go));
  for (const std::size_t count : {100, 1})
    scheduler.submit(count, [&](std::size_t) {
      left.count_down();
      return true;
    });
  left.wait();
  go.set_value();
  EXPECT_TRUE(scheduler.shut_down(kLong));
}

TEST(Scheduler, TellsWhatItsThreadsDid) {
  const auto at_first = Scheduler::Clock::now();
  Scheduler scheduler(2);
  const auto idle = [&] { return scheduler.usage().idle_seconds; };
  while (idle() < 0.02) std::this_thread::yield();
  EXPECT_EQ(scheduler.usage().busy_seconds, 0);
  EXPECT_EQ(scheduler.usage().starved_seconds, 0);
  std::promise<void> go;
  scheduler.submit(1, wait_for(go));
  while (scheduler.usage().busy == 0) std::this_thread::yield();
  while (scheduler.usage().busy_seconds < 0.02) std::this_thread::yield();
  const Scheduler::Usage one_at_work = scheduler.usage();
  EXPECT_EQ(one_at_work.threads, 2u);
  EXPECT_EQ(one_at_work.busy, 1u);
  EXPECT_DOUBLE_EQ(one_at_work.busy_seconds, one_at_work.starved_seconds);  // While one worked the other had nothing.
  go.set_value();
  while (scheduler.usage().busy > 0) std::this_thread::yield();
  const Scheduler::Usage all = scheduler.usage();
  const std::chrono::duration<double> wall = Scheduler::Clock::now() - at_first;
  EXPECT_LE(all.busy_seconds + all.starved_seconds + all.idle_seconds, 2 * wall.count() + 1e-6);
}

TEST(Scheduler, NoMoreThreadsThanUsualAreAtWorkWhenLongStepsHaveEnded) {
  Scheduler scheduler(1, std::chrono::seconds(2));  // longer than a busy machine holds up a short step
  std::promise<void> go, seen;
  auto owned = std::make_shared<int>(1);
  const std::weak_ptr<int> long_batch = owned;
  scheduler.submit(1, [owned = std::move(owned), until = wait_for(go)](std::size_t i) { return until(i); });
  scheduler.submit(1, [&](std::size_t) {
    seen.set_value();
    return true;
  });
  seen.get_future().wait();  // by a second thread
  go.set_value();
  while (!long_batch.expired()) std::this_thread::yield();
  std::atomic<int> at_work = 0, most = 0;
  std::latch left(1000);
  scheduler.submit(1000, [&](std::size_t) {
    const int now = ++at_work;
    if (now > most) most = now;
    --at_work;
    left.count_down();
    return true;
  });
  left.wait();
  EXPECT_TRUE(scheduler.shut_down(kLong));
  EXPECT_EQ(most, 1);
}

}  // namespace
}  // namespace tessera::server

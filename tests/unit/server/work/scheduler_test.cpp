#include "server/work/scheduler.h"

#include <atomic>
#include <future>
#include <latch>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>

namespace tessera::server {
namespace {

using std::chrono::seconds;
using Turn = Scheduler::Turn;
constexpr seconds kLong{60};

/// A unit that is at work until `go` is set.
Scheduler::Unit wait_for(std::promise<void>& go) {
  return [future = go.get_future().share()](std::size_t, const Turn&) {
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
    scheduler.submit(kUnits, [&, b](std::size_t i, const Turn&) {
      ++runs[b * kUnits + i];
      left.count_down();
      return true;
    });
  left.wait();
  EXPECT_TRUE(scheduler.shut_down(kLong));
  for (const auto& count : runs) EXPECT_EQ(count, 1);
}

TEST(Scheduler, ItsThreadsGiveWayToAllOthers) {
  // In Linux, 0 is the calling thread.
  const auto nice_value = [] { return ::getpriority(PRIO_PROCESS, 0); };
  std::promise<int> theirs;
  Scheduler scheduler(1);
  scheduler.submit(1, [&](std::size_t, const Turn&) {
    theirs.set_value(nice_value());
    return true;
  });
  EXPECT_GT(theirs.get_future().get(), nice_value());
  EXPECT_TRUE(scheduler.shut_down(kLong));
}

/// Jobs of one scheduler, and what they do in the order of doing it.
class SchedulerOrder : public testing::Test {
 protected:
  /// Units of so many steps each, which say their name and number.
  void submit(const Scheduler::Job& job, std::size_t units, char name, int steps) {
    left_ += static_cast<int>(units) * steps;
    scheduler_.submit(job, units,
                      [this, name, steps, done = std::map<std::size_t, int>()](std::size_t i, const Turn&) mutable {
                        order_ += name + std::to_string(i) + ' ';
                        if (--left_ == 0) end_.set_value();
                        return ++done[i] == steps;
                      });
  }

  /// What is said by what `submit_all` submits, on one thread that has other work until all of it is there.
  template <typename SubmitAll>
  std::string order(SubmitAll submit_all) {
    std::promise<void> go;
    scheduler_.submit(scheduler_.open({"another"}), 1, wait_for(go));
    while (scheduler_.usage().busy == 0) std::this_thread::yield();
    submit_all();
    go.set_value();
    end_.get_future().wait();
    return order_;
  }

  std::string order_;
  std::atomic<int> left_ = 0;
  std::promise<void> end_;
  Scheduler scheduler_{1, kLong};
};

TEST_F(SchedulerOrder, AStepThatIsNotDoneGoesOnBeforeNewUnits) {
  EXPECT_EQ(order([&] { submit(scheduler_.open({}), 2, 'a', 3); }), "a0 a0 a0 a1 a1 a1 ");
}

TEST_F(SchedulerOrder, SmallJobsAreDoneOneAfterTheOther) {
  EXPECT_EQ(order([&] {
              for (const char name : {'a', 'b', 'c'}) submit(scheduler_.open({}), 2, name, 2);
            }),
            "a0 a0 a1 a1 b0 b0 b1 b1 c0 c0 c1 c1 ");
}

TEST_F(SchedulerOrder, UrgentJobsGoBeforeOthers) {
  EXPECT_EQ(order([&] {
              submit(scheduler_.open({"", proto::Priority::low}), 1, 'l', 1);
              submit(scheduler_.open({"", proto::Priority::normal}), 1, 'n', 1);
              submit(scheduler_.open({"", proto::Priority::high}), 1, 'h', 1);
            }),
            "h0 n0 l0 ");
}

TEST(Scheduler, ATurnIsOverWhenSomebodyComesWhoGoesBefore) {
  Scheduler scheduler(1, kLong, kLong);
  std::promise<void> begun;
  std::string order;
  std::latch left(2);
  scheduler.submit(scheduler.open({"", proto::Priority::low}), 1, [&](std::size_t, const Turn& turn) {
    const bool is_first = order.empty();
    order += 'l';
    if (is_first) {
      begun.set_value();
      while (!turn.is_over()) std::this_thread::yield();
      return false;
    }
    left.count_down();
    return true;
  });
  begun.get_future().wait();
  scheduler.submit(scheduler.open({"", proto::Priority::high}), 1, [&](std::size_t, const Turn&) {
    order += 'h';
    left.count_down();
    return true;
  });
  left.wait();
  EXPECT_TRUE(scheduler.shut_down(kLong));
  EXPECT_EQ(order, "lhl");
}

TEST(Scheduler, ATurnTellsWhetherThreadsHaveNothingToDo) {
  Scheduler scheduler(2, kLong, kLong);
  std::promise<void> go;
  std::latch left(2);
  scheduler.submit(2, [&](std::size_t i, const Turn& turn) {
    while (turn.has_idle_threads() != (i == 1)) std::this_thread::yield();  // the first one ends first
    left.count_down();
    return true;
  });
  left.wait();
  EXPECT_TRUE(scheduler.shut_down(kLong));
}

TEST(Scheduler, UnitsMaySubmitMore) {
  Scheduler scheduler(2);
  std::latch left(1 + 10 * 10);
  scheduler.submit(10, [&](std::size_t i, const Turn&) {
    scheduler.submit(10, [&](std::size_t, const Turn&) {
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
      [&](std::size_t, const Turn&) {
        if (++runs == 3) stop.request_stop();
        return true;
      },
      stop.get_token());
  scheduler.submit(5, [&](std::size_t i, const Turn&) {
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
      9, [owned](std::size_t, const Turn&) { return true; }, stop.get_token());
  scheduler.submit(1, [&](std::size_t, const Turn&) {
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
  scheduler.submit(100, [&, future = go.get_future().share()](std::size_t i, const Turn&) {
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
  scheduler.submit(1, [&](std::size_t, const Turn&) {
    ++runs;
    return true;
  });
  EXPECT_TRUE(scheduler.shut_down(kLong));
  EXPECT_EQ(runs, 1);
}

TEST(Scheduler, NoMoreUnitsAreBegunThanThreadsAreAtWork) {
  constexpr std::size_t kUnits = 100;
  constexpr unsigned kThreads = 3;
  Scheduler scheduler(kThreads, kLong);
  std::vector<std::atomic<int>> steps(kUnits);
  std::atomic<unsigned> open = 0, most_open = 0;
  std::latch left(kUnits);
  scheduler.submit(kUnits, [&](std::size_t i, const Turn&) {
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
      [&, owned](std::size_t, const Turn&) {
        if (++steps == 3) stop.request_stop();
        return false;
      },
      stop.get_token());
  scheduler.submit(1, [&](std::size_t, const Turn&) {
    if (!stop.stop_requested() || ++steps_after < 2) return false;  // By the second one, all have had a turn.
    done.set_value();
    return true;
  });
  done.get_future().wait();
  EXPECT_EQ(owned.use_count(), 1);
  EXPECT_EQ(steps, 3);
}

TEST(Scheduler, AStopDropsWhatWaitsBehindOthers) {
  Scheduler scheduler(1, kLong);
  std::atomic<bool> goes_on = true;
  scheduler.submit(scheduler.open({"", proto::Priority::high}), 1,
                   [&](std::size_t, const Turn&) { return !goes_on.load(); });
  auto owned = std::make_shared<int>(1);
  const std::weak_ptr<int> waiting = owned;
  std::stop_source stop;
  std::atomic<int> runs = 0;
  while (scheduler.usage().busy == 0) std::this_thread::yield();
  stop.request_stop();
  scheduler.submit(
      scheduler.open({"", proto::Priority::low}), 9,
      [&, owned = std::move(owned)](std::size_t, const Turn&) {
        ++runs;
        return true;
      },
      stop.get_token());
  while (!waiting.expired()) std::this_thread::yield();
  EXPECT_EQ(runs, 0);
  goes_on = false;
}

TEST(Scheduler, ShutsDownBetweenTwoSteps) {
  const auto owned = std::make_shared<int>(1);
  {
    Scheduler scheduler(2);
    std::latch begun(1);
    std::atomic_flag first;
    scheduler.submit(5, [&, owned](std::size_t, const Turn&) {
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
    scheduler.submit(count, [&](std::size_t, const Turn&) {
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

TEST(Scheduler, TellsWhatWasSpentOnAJob) {
  Scheduler scheduler(2);
  const auto job = scheduler.open({}), other = scheduler.open({});
  EXPECT_EQ(scheduler.spent(job).busy_seconds, 0);
  std::promise<void> go;
  scheduler.submit(job, 1, wait_for(go));
  while (scheduler.spent(job).busy_seconds < 0.01) std::this_thread::yield();
  EXPECT_GT(scheduler.spent(job).starved_seconds, 0) << "of the other thread";
  const auto later = scheduler.open({});
  EXPECT_LT(scheduler.spent(later).starved_seconds, scheduler.spent(job).starved_seconds);
  go.set_value();
  while (scheduler.usage().busy > 0) std::this_thread::yield();
  EXPECT_GE(scheduler.spent(job).busy_seconds, 0.01);
  EXPECT_EQ(scheduler.spent(job).busy_seconds, scheduler.usage().busy_seconds);
  EXPECT_EQ(scheduler.spent(other).busy_seconds, 0);
}

TEST(Scheduler, NoMoreThreadsThanUsualAreAtWorkWhenLongStepsHaveEnded) {
  Scheduler scheduler(1, std::chrono::seconds(2));  // longer than a busy machine holds up a short step
  std::promise<void> go, seen;
  auto owned = std::make_shared<int>(1);
  const std::weak_ptr<int> long_batch = owned;
  scheduler.submit(
      1, [owned = std::move(owned), until = wait_for(go)](std::size_t i, const Turn& turn) { return until(i, turn); });
  scheduler.submit(1, [&](std::size_t, const Turn&) {
    seen.set_value();
    return true;
  });
  seen.get_future().wait();  // by a second thread
  go.set_value();
  while (!long_batch.expired()) std::this_thread::yield();
  std::atomic<int> at_work = 0, most = 0;
  std::latch left(1000);
  scheduler.submit(1000, [&](std::size_t, const Turn&) {
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

#include "server/work/turn_order.h"

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

using proto::Priority;
using Time = TurnOrder::Time;
using std::chrono::milliseconds;
using std::chrono::seconds;

class TurnOrderTest : public testing::Test {
 protected:
  struct Job : TurnOrder::Account {
    Job(TurnOrder& order, const Claim& claim) : Account(order, claim) {}
  };

  /// A job that has work for ever.
  std::shared_ptr<Job> add(const std::string& owner, Priority priority = Priority::normal, double weight = 1) {
    auto job = std::make_shared<Job>(order_, Claim{owner, priority, weight});
    order_.set_waiting(*job, true);
    return job;
  }

  /// Gives turns until so much time has been spent altogether.
  void spend(Time all, Time turn = TurnOrder::kTurn) {
    for (Time spent{}; spent < all; spent += turn) {
      TurnOrder::Account* next = order_.next();
      order_.begin_turn(*next);
      order_.end_turn(*next, turn);
    }
  }

  static double used(const std::vector<std::shared_ptr<Job>>& jobs) {
    Time all{};
    for (const auto& job : jobs) all += job->used();
    return std::chrono::duration<double>(all).count();
  }

  TurnOrder order_;
};

TEST_F(TurnOrderTest, AnOwnerOfManyJobsHasNoMoreThanOneOfOne) {
  std::vector<std::shared_ptr<Job>> many;
  for (int i = 0; i < 50; ++i) many.push_back(add("many"));
  const auto one = add("one");
  spend(seconds(100));
  EXPECT_NEAR(used({one}), 50, 1);
  EXPECT_NEAR(used(many), 50, 1);
  for (const auto& job : many) EXPECT_GT(used({job}), 0.1);
}

TEST_F(TurnOrderTest, OwnersHaveByTheirWeight) {
  const auto three = add("three", Priority::normal, 3), one = add("one");
  spend(seconds(100));
  EXPECT_NEAR(used({three}), 75, 1);
  EXPECT_NEAR(used({one}), 25, 1);
}

TEST_F(TurnOrderTest, AnOwnersPrioritiesTakeNothingFromOtherOwners) {
  const auto low = add("a", Priority::low), high = add("b", Priority::high), normal = add("b");
  spend(seconds(90));
  EXPECT_NEAR(used({low}), 45, 1);
  EXPECT_NEAR(used({high}), 40, 1);
  EXPECT_NEAR(used({normal}), 5, 1);
}

/// However many urgent jobs come, and though each is the younger one.
TEST_F(TurnOrderTest, NothingStarves) {
  const auto low = add("", Priority::low), old = add("");
  spend(seconds(100));
  const double low_had = used({low}), old_had = used({old});
  for (int i = 0; i < 1000; ++i) {
    const auto high = add("", Priority::high), young = add("");
    spend(milliseconds(300));
    order_.set_waiting(*high, false);
    order_.set_waiting(*young, false);
  }
  EXPECT_GT(used({low}) - low_had, 300.0 / 73 - 1);
  EXPECT_GT(used({old}) - old_had, 300.0 * 8 / 73 / 17 - 1);
}

/// What comes later goes behind it in the end, however urgent it is.
TEST_F(TurnOrderTest, WaitingJobsAge) {
  const auto busy = add("", Priority::high);
  spend(seconds(10));
  const auto low = add("", Priority::low);
  int turns = 0;
  for (;; ++turns) {
    const auto later = add("", Priority::high);
    ASSERT_LE(turns, 64) << "as many as the priorities have turns";
    if (order_.next() == low.get()) break;
    spend(TurnOrder::kTurn);
    order_.set_waiting(*later, false);
  }
  EXPECT_GE(turns, 60);
}

TEST_F(TurnOrderTest, AJobThatTakesLittleEndsSoonBesideOldOnes) {
  const auto old = add("");
  spend(seconds(1000));
  const auto young = add("");
  for (const double had : {0.05, 0.3, 1.5, 6.0, 20.0, 60.0}) {
    const double before = used({old});
    Time all{};
    while (used({young}) < had) {
      spend(milliseconds(10), milliseconds(10));
      all += milliseconds(10);
    }
    EXPECT_LE(used({old}) - before, 0.75 * had) << had;
    EXPECT_LT(used({old, young}), 1000 + 2 * had) << "twice the time that it takes alone";
  }
  const double before = used({old}), young_had = used({young});
  spend(seconds(100));
  EXPECT_NEAR(used({old}) - before, 50, 1) << "when it has grown old, it is like others";
  EXPECT_NEAR(used({young}) - young_had, 50, 1);
}

TEST_F(TurnOrderTest, SmallJobsAreDoneInTheOrderOfTheirComing) {
  std::vector<std::shared_ptr<Job>> jobs;
  for (int i = 0; i < 100; ++i) jobs.push_back(add(""));
  for (const auto& job : jobs) {
    for (int turn = 0; turn < 9; ++turn) {
      ASSERT_EQ(order_.next(), job.get());
      order_.begin_turn(*job);
      order_.set_waiting(*job, false);  // as between passes
      order_.end_turn(*job, milliseconds(10));
      order_.set_waiting(*job, true);
    }
    order_.set_waiting(*job, false);
  }
  EXPECT_TRUE(order_.is_empty());
}

TEST_F(TurnOrderTest, JobsOfAnAgeHaveTheSame) {
  const std::vector jobs{add(""), add(""), add("")};
  spend(seconds(100));
  const std::vector before{used({jobs[0]}), used({jobs[1]}), used({jobs[2]})};
  spend(seconds(30));
  for (std::size_t i = 0; i < jobs.size(); ++i) EXPECT_NEAR(used({jobs[i]}) - before[i], 10, 0.2);
}

/// Whoever hands in one job after the other, each when the last one has ended.
TEST_F(TurnOrderTest, ComingAndGoingGainsNoMoreThanAHeadStart) {
  const auto steady = add("steady");
  spend(seconds(10));
  double had = 0;
  const double before = used({steady});
  for (int i = 0; i < 1000; ++i) {
    const auto job = add("coming and going");
    while (job->used() == Time::zero()) spend(milliseconds(30));
    order_.set_waiting(*job, false);
    had += used({job});
  }
  EXPECT_NEAR(had, used({steady}) - before, 1);
}

TEST_F(TurnOrderTest, WhoWasIdleIsOwedNoMoreThanAHeadStart) {
  const auto steady = add("steady"), idle = add("idle");
  spend(seconds(2));
  order_.set_waiting(*idle, false);
  spend(seconds(1000));
  order_.set_waiting(*idle, true);
  const double steady_had = used({steady}), idle_had = used({idle});
  spend(seconds(10));
  EXPECT_NEAR(used({idle}) - idle_had, 5.25, 0.2);
  EXPECT_NEAR(used({steady}) - steady_had, 4.75, 0.2);
}

TEST_F(TurnOrderTest, TurnsAreCountedWhenTheyBegin) {
  const auto a = add("a"), b = add("b");
  spend(seconds(2));
  TurnOrder::Account* first = order_.next();
  order_.begin_turn(*first);
  EXPECT_NE(order_.next(), first) << "though nobody knows yet what that one takes";
}

TEST_F(TurnOrderTest, LongTurnsArePaidForLater) {
  const auto builds = add("builds"), renders = add("renders");
  spend(seconds(2));
  order_.begin_turn(*builds);
  order_.end_turn(*builds, seconds(10));
  const double before = used({builds});
  spend(seconds(9));
  EXPECT_EQ(used({builds}), before);
}

TEST_F(TurnOrderTest, SaysWhoMakesWayForWhom) {
  const auto old = add("a"), other = add("b");
  spend(seconds(20));
  order_.set_waiting(*old, false);
  order_.begin_turn(*old);
  EXPECT_TRUE(order_.goes_before(*other, *old)) << "by its turn the other one has had more";
  order_.end_turn(*old, {});
  const auto young = add("a"), urgent = add("a", Priority::high), low = add("a", Priority::low);
  EXPECT_TRUE(order_.goes_before(*young, *old));
  EXPECT_FALSE(order_.goes_before(*old, *young));
  EXPECT_TRUE(order_.goes_before(*urgent, *young));
  EXPECT_FALSE(order_.goes_before(*add("a"), *young)) << "they take turns";
  order_.begin_turn(*low);
  order_.end_turn(*low, seconds(100));
  EXPECT_FALSE(order_.goes_before(*low, *old));
}

}  // namespace
}  // namespace tessera::server

#include "server/store/single_flight.h"

#include <atomic>
#include <future>
#include <latch>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

using Flights = SingleFlight<int>;

constexpr std::uint64_t kRoomy = 1 << 20;

Flights::Make always(int value, std::optional<std::uint64_t> bytes = 1) {
  return [=](const std::stop_token&) { return Flights::Made{value, bytes}; };
}

TEST(SingleFlight, KeepsWhatFits) {
  Flights flights(kRoomy);
  EXPECT_EQ(flights.get("a", always(1), std::stop_token{}), 1);
  EXPECT_EQ(flights.get("a", always(2), std::stop_token{}), 1);
  EXPECT_EQ(flights.get("large", always(3, kRoomy), std::stop_token{}), 3);
  EXPECT_EQ(flights.find("large"), std::nullopt);
  EXPECT_EQ(flights.get("unkept", always(4, std::nullopt), std::stop_token{}), 4);
  EXPECT_EQ(flights.find("unkept"), std::nullopt);
}

TEST(SingleFlight, TellsWhatWasAskedOfIt) {
  Flights flights(kRoomy);
  flights.get("a", always(1), std::stop_token{});
  flights.get("a", always(1), std::stop_token{});
  flights.find("a");
  flights.find("b");  // Who doesn't find it has it made, or doesn't need it.
  std::promise<void> go;
  std::jthread maker([&] {
    const auto make = [&](const std::stop_token&) {
      go.get_future().wait();
      return Flights::Made{2, 1};
    };
    flights.get("b", make, std::stop_token{});
  });
  while (flights.usage().misses < 2) std::this_thread::yield();
  flights.get("b", always(3), [](const Flights::Answer&, bool shared) { EXPECT_TRUE(shared); }, {});
  go.set_value();
  maker.join();
  const CacheUsage usage = flights.usage();
  EXPECT_EQ(usage.hits, 2u);
  EXPECT_EQ(usage.joined, 1u);
  EXPECT_EQ(usage.misses, 2u);
  EXPECT_EQ(usage.limit, kRoomy);
  EXPECT_EQ(usage.bytes, 2 * (1 + Lru<int>::overhead("a")));
}

TEST(SingleFlight, MakesOnceForAllWhoAskAtOnce) {
  constexpr int kThreads = 8;
  for (int round = 0; round < 50; ++round) {
    Flights flights(kRoomy);
    std::atomic<int> made = 0;
    std::latch start(kThreads);
    std::vector<std::jthread> threads;
    for (int i = 0; i < kThreads; ++i)
      threads.emplace_back([&] {
        start.arrive_and_wait();
        const auto make = [&](const std::stop_token&) { return Flights::Made{++made, 1}; };
        EXPECT_EQ(flights.get("a", make, std::stop_token{}), 1);
      });
    threads.clear();
    EXPECT_EQ(made, 1) << "round " << round;
  }
}

TEST(SingleFlight, WhatIsKeptMayBeAnother) {
  Flights flights(kRoomy);
  const Flights::Make make = [](const std::stop_token&) { return Flights::Made{1, 1, 2}; };
  EXPECT_EQ(flights.get("a", make, std::stop_token{}), 1);
  EXPECT_EQ(flights.get("a", make, std::stop_token{}), 2);
}

TEST(SingleFlight, DropsWhatIsMeantAlone) {
  Flights flights(kRoomy);
  for (const char* key : {"1 2", "1 23"}) flights.get(key, always(1), std::stop_token{});
  flights.drop("1 2", [](int kept) { return kept == 2; });
  EXPECT_EQ(flights.find("1 2"), 1);
  flights.drop("1 2", [](int kept) { return kept == 1; });
  EXPECT_EQ(flights.find("1 2"), std::nullopt);
  EXPECT_EQ(flights.find("1 23"), 1) << "whose key begins so";
}

TEST(SingleFlight, AFailureIsToldAndNotKept) {
  Flights flights(kRoomy);
  const Flights::Make fails = [](const std::stop_token&) -> Flights::Made { throw std::runtime_error("no luck"); };
  EXPECT_THROW(flights.get("a", fails, std::stop_token{}), std::runtime_error);
  EXPECT_EQ(flights.get("a", always(1), std::stop_token{}), 1);
}

/// A value that is being made on a thread of its own until it is let go, or unwanted.
struct InTheMaking {
  explicit InTheMaking(Flights& flights)
      : thread([this, &flights] {
          const Flights::Make make = [this](const std::stop_token& unwanted) {
            begun.set_value();
            const std::stop_callback stopped(unwanted, [this] { let_go(); });
            go.get_future().wait();
            if (unwanted.stop_requested()) throw proto::Abandoned();
            return Flights::Made{1, 1, 3};
          };
          try {
            outcome = flights.get("a", make, abandoned.get_token());
          } catch (const proto::Abandoned&) {
            outcome = -1;
          }
        }) {
    begun.get_future().wait();
  }
  void let_go() {
    if (!gone.exchange(true)) go.set_value();
  }

  std::stop_source abandoned;
  std::promise<void> begun, go;
  std::atomic<bool> gone = false;
  int outcome = 0;
  std::jthread thread;
};

TEST(SingleFlight, StopsWhenTheOnlyOneWhoAskedHasGone) {
  Flights flights(kRoomy);
  InTheMaking first(flights);
  first.abandoned.request_stop();
  first.thread.join();
  EXPECT_EQ(first.outcome, -1);
  EXPECT_EQ(flights.get("a", always(2), std::stop_token{}), 2);
}

TEST(SingleFlight, GoesOnForThoseWhoStillWait) {
  Flights flights(kRoomy);
  InTheMaking first(flights);
  std::promise<int> told;
  flights.get("a", always(2),
              [&](const Flights::Answer& answer, bool shared) {
                EXPECT_TRUE(shared);
                told.set_value(answer.value.value_or(-1));
              },
              {});
  first.abandoned.request_stop();
  EXPECT_FALSE(first.gone) << "another one still wants it";
  first.let_go();
  EXPECT_EQ(told.get_future().get(), 1) << "what was made, which the first one had, too";
  first.thread.join();
  EXPECT_EQ(flights.find("a"), 3) << "what is kept";
}

TEST(SingleFlight, WhoHasGoneNoLongerWaits) {
  Flights flights(kRoomy);
  InTheMaking first(flights);
  std::stop_source abandoned;
  std::thread second([&] { EXPECT_THROW(flights.get("a", always(2), abandoned.get_token()), proto::Abandoned); });
  abandoned.request_stop();
  second.join();  // Though the first is still at it.
  EXPECT_FALSE(first.gone);
  first.let_go();
  first.thread.join();
  EXPECT_EQ(first.outcome, 1);
}

TEST(SingleFlight, WhoComesAfterAllHaveGoneBeginsAnew) {
  Flights flights(kRoomy);
  std::stop_source abandoned;
  const Flights::Make make = [&](const std::stop_token& unwanted) {
    abandoned.request_stop();
    EXPECT_TRUE(unwanted.stop_requested());
    EXPECT_EQ(flights.get("a", always(2), std::stop_token{}), 2) << "while the first hasn't noticed yet";
    return Flights::Made{1, 1};
  };
  flights.get("a", make, abandoned.get_token());
}

TEST(SingleFlight, DropsByPrefix) {
  Flights flights(kRoomy);
  for (const char* key : {"job1 png", "job1 exr", "job11 png", "job2 png"})
    flights.get(key, always(1), std::stop_token{});
  flights.drop_all("job1 ");
  EXPECT_FALSE(flights.find("job1 png") || flights.find("job1 exr"));
  EXPECT_TRUE(flights.find("job11 png") && flights.find("job2 png"));
}

TEST(SingleFlight, CountsAnewOnlyWhatIsKept) {
  Flights flights(kRoomy);
  EXPECT_EQ(flights.find_or_keep("a", 1, 1), 1);
  EXPECT_EQ(flights.find_or_keep("a", 2, 1), 1);
  flights.recount("a", 2, kRoomy);
  EXPECT_EQ(flights.find("a"), 1) << "that was another one";
  flights.recount("a", 1, kRoomy);
  EXPECT_EQ(flights.find("a"), std::nullopt);
}

}  // namespace
}  // namespace tessera::server

#include "server/jobs/event_feed.h"

#include <optional>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

constexpr std::size_t kAll = 1000;

struct Counter final : EventFeed::Watcher {
  void told() noexcept override { ++count; }
  int count = 0;
};

using Told = std::vector<std::string>;

/// "first queued 7", say: all that is told after an event.
Told told_after(const EventFeed& feed, EventId last, const std::optional<std::string>& owner = std::nullopt) {
  constexpr const char* kNames[] = {"queued", "preparing", "rendering", "ended"};
  Told told;
  for (const EventFeed::Event& event : feed.after(last, kAll, owner)) {
    const char* what = event.step ? kNames[static_cast<int>(*event.step)] : event.expired ? "expired" : "deleted";
    told.push_back(event.job + ' ' + what + ' ' + text_of(event.id));
  }
  return told;
}

void happen(EventFeed& feed, const std::string& job, JobStep step, std::optional<std::uint64_t> seq) {
  (void)feed.happened(job, step, seq);
}

TEST(EventId, IsWrittenAndRead) {
  for (const EventId id : {EventId{0, 0}, EventId{17, 0}, EventId{17, 2}, EventId{~0ULL, ~0ULL}})
    EXPECT_EQ(read_event_id(text_of(id)), id);
  EXPECT_EQ(text_of({17, 0}), "17");
  EXPECT_EQ(text_of({17, 2}), "17.2");
  for (const char* text : {"", "x", "17.", ".2", "-1", "1e3", " 1", "1 ", "1.2.3", "18446744073709551616", "0x1"})
    EXPECT_FALSE(read_event_id(text)) << text;
}

TEST(EventFeed, TellsStepsInTheirOrder) {
  EventFeed feed;
  feed.add("first", "");
  feed.add("second", "");
  happen(feed, "first", JobStep::queued, 3);
  happen(feed, "second", JobStep::queued, 4);
  happen(feed, "first", JobStep::preparing, 6);
  EXPECT_EQ(told_after(feed, {}), (Told{"first queued 3", "second queued 4", "first preparing 6"}));
  EXPECT_EQ(told_after(feed, {3, 0}), (Told{"second queued 4", "first preparing 6"}));
  EXPECT_EQ(told_after(feed, feed.last()), Told{});
  EXPECT_EQ(feed.steps_of("first")[0], (EventId{3, 0}));
  EXPECT_FALSE(feed.steps_of("first")[2]);
  EXPECT_EQ(feed.steps_of("nobody"), EventFeed::Steps());
}

TEST(EventFeed, TellsOwnersThatJobsAreThereNoMore) {
  EventFeed feed;
  Counter watcher;
  for (const char* job : {"hers", "his"}) feed.add(job, job);
  happen(feed, "hers", JobStep::queued, 1);
  happen(feed, "his", JobStep::queued, 2);
  ASSERT_TRUE(feed.watch(std::nullopt, watcher));
  (void)feed.forget("hers");
  (void)feed.removed("hers", "hers", false, 3);
  EXPECT_EQ(watcher.count, 1);
  happen(feed, "his", JobStep::ended, 4);
  (void)feed.forget("his");
  (void)feed.removed("his", "his", true, std::nullopt);
  EXPECT_EQ(told_after(feed, {}), (Told{"hers deleted 3", "his expired 4.1"}));
  EXPECT_EQ(told_after(feed, {}, "his"), Told{"his expired 4.1"});
  EXPECT_EQ(told_after(feed, feed.last()), Told{});
  for (int i = 0; i < 20'000; ++i) (void)feed.removed("one of many", "", false, 5 + i);
  EventId begin;
  EXPECT_EQ(feed.after(begin, 1, std::nullopt).front().id, (EventId{10'005, 0}));
}

TEST(EventFeed, WhatIsntWrittenStandsBehindWhatIs) {
  EventFeed feed;
  feed.begin_after(10);
  for (const char* job : {"written", "not", "neither"}) feed.add(job, "");
  happen(feed, "not", JobStep::queued, std::nullopt);
  happen(feed, "neither", JobStep::queued, std::nullopt);
  happen(feed, "written", JobStep::queued, 12);
  happen(feed, "not", JobStep::preparing, std::nullopt);
  EXPECT_EQ(told_after(feed, {}),
            (Told{"not queued 10.1", "neither queued 10.2", "written queued 12", "not preparing 12.1"}));
  EXPECT_EQ(told_after(feed, {10, 1}).front(), "neither queued 10.2");
}

TEST(EventFeed, AJobThatIsQueuedAgainBeginsAnew) {
  EventFeed feed;
  feed.add("job", "");
  std::uint64_t seq = 0;
  for (const JobStep step : {JobStep::queued, JobStep::preparing, JobStep::rendering, JobStep::ended})
    happen(feed, "job", step, ++seq);
  EXPECT_EQ(feed.rendering("", kAll, std::nullopt), Told{});
  happen(feed, "job", JobStep::queued, 5);
  EXPECT_EQ(told_after(feed, {}), Told{"job queued 5"});
  happen(feed, "job", JobStep::preparing, 6);
  happen(feed, "job", JobStep::rendering, 7);
  EXPECT_EQ(told_after(feed, {5, 0}), (Told{"job preparing 6", "job rendering 7"}));
  EXPECT_EQ(feed.rendering("", kAll, std::nullopt), Told{"job"});
}

TEST(EventFeed, KnowsWhatRendersAndWhoseItIs) {
  EventFeed feed;
  for (const auto& [job, owner] : {std::pair{"a", "one"}, {"b", "other"}, {"c", "one"}}) {
    feed.add(job, owner);
    happen(feed, job, JobStep::rendering, std::nullopt);
  }
  EXPECT_EQ(feed.rendering("", kAll, "one"), (Told{"a", "c"}));
  EXPECT_EQ(feed.rendering("a", kAll, std::nullopt), (Told{"b", "c"}));
  EXPECT_EQ(feed.rendering("", 1, std::nullopt), Told{"a"});
  EXPECT_EQ(told_after(feed, {}, "other"), Told{"b rendering 0.2"});
  EventId last;
  (void)feed.after(last, kAll, "nobody");
  EXPECT_EQ(last, feed.last()) << "what others may see needn't be looked at again";
  happen(feed, "a", JobStep::ended, std::nullopt);
  (void)feed.forget("b");
  EXPECT_EQ(feed.rendering("", kAll, std::nullopt), Told{"c"});
  EXPECT_EQ(told_after(feed, {}), (Told{"a rendering 0.1", "c rendering 0.3", "a ended 0.4"}));
}

TEST(EventFeed, TellsWatchersOnceForEachTimeThatTheyBegin) {
  EventFeed feed;
  feed.add("job", "");
  feed.add("other", "");
  Counter one, all;
  ASSERT_TRUE(feed.watch("job", one));
  ASSERT_TRUE(feed.watch(std::nullopt, all));
  happen(feed, "other", JobStep::queued, 1);
  EXPECT_EQ(one.count, 0);
  EXPECT_EQ(all.count, 1);
  {
    const auto audience = feed.happened("job", JobStep::queued, 2);
    EXPECT_EQ(one.count, 0) << "told by whoever has the audience, when it lets go of it";
    EXPECT_FALSE(feed.stop_watching("job", one)) << "it is about to be told";
  }
  EXPECT_EQ(one.count, 1);
  EXPECT_EQ(all.count, 1);
  happen(feed, "job", JobStep::preparing, 3);
  EXPECT_EQ(one.count, 1);
}

TEST(EventFeed, WhoStopsWatchingIsToldNoMore) {
  EventFeed feed;
  feed.add("job", "");
  Counter first, second, third;
  for (Counter* watcher : {&first, &second, &third}) ASSERT_TRUE(feed.watch("job", *watcher));
  EXPECT_TRUE(feed.stop_watching("job", second));
  EXPECT_FALSE(feed.stop_watching("job", second));
  happen(feed, "job", JobStep::queued, 1);
  EXPECT_EQ(first.count + third.count, 2);
  EXPECT_EQ(second.count, 0);
}

TEST(EventFeed, WatchersOfWhatGoesAwayAreTold) {
  EventFeed feed;
  feed.add("job", "");
  feed.add("other", "");
  Counter forgotten, other, all;
  ASSERT_TRUE(feed.watch("job", forgotten));
  (void)feed.forget("job");
  EXPECT_EQ(forgotten.count, 1);
  EXPECT_FALSE(feed.watch("job", forgotten));
  ASSERT_TRUE(feed.watch("other", other));
  ASSERT_TRUE(feed.watch(std::nullopt, all));
  (void)feed.close();
  EXPECT_EQ(other.count, 1);
  EXPECT_EQ(all.count, 1);
  EXPECT_FALSE(feed.watch("other", other));
  EXPECT_FALSE(feed.watch(std::nullopt, all));
}

}  // namespace
}  // namespace tessera::server

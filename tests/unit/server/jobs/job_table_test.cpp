#include "server/jobs/job_table.h"

#include <filesystem>
#include <future>
#include <memory>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

#include "proto/wire/abandoned.h"
#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {

using proto::JobState;
using proto::ProblemCode;

constexpr JobTable::Limits kRoomy{1000, 1000, 1ULL << 40};

JobOrder order(std::uint32_t width = 10, std::uint32_t height = 10) {
  JobOrder order{"", "sha256:" + std::string(64, '0'), 0, {}};
  order.settings.width = width;
  order.settings.height = height;
  return order;
}

std::string add(JobTable& table) { return (*table.add(order())).id; }

std::shared_ptr<const Film> film() {
  return std::make_shared<Film>(10, 10, std::set<Aov>{}, std::vector<PixelRect>{{0, 0, 10, 10}});
}

JobState state(const JobTable& table, const std::string& id) { return (*table.find(id)).state; }

TEST(JobTable, TakesAJobThroughItsStates) {
  JobTable table(kRoomy);
  const std::string id = add(table);
  EXPECT_EQ(state(table, id), JobState::queued);
  EXPECT_TRUE(table.start_preparing(id));
  EXPECT_TRUE(table.is_unfinished(id));
  EXPECT_EQ(state(table, id), JobState::preparing);
  EXPECT_TRUE(table.set_plan(id, std::make_shared<PlanReport>(), nullptr));
  EXPECT_TRUE(table.start_rendering(id, std::nullopt, film()));
  EXPECT_EQ(state(table, id), JobState::rendering);
  EXPECT_TRUE(table.complete(id));
  const JobView job = *table.find(id);
  EXPECT_EQ(job.state, JobState::completed);
  EXPECT_TRUE(job.times.preparing && job.times.rendering && job.times.ended && job.plan);
  EXPECT_EQ(job.image, proto::ImageState::complete);
  EXPECT_TRUE(table.film(id));
}

TEST(JobTable, TellsHowManyAreInWhichState) {
  JobTable table({1000, 2, 1ULL << 40});
  const auto counts = [&] { return table.usage().by_state; };
  using Counts = std::array<std::uint32_t, 6>;
  const std::string first = add(table), second = add(table), third = add(table);
  EXPECT_EQ(counts(), (Counts{3, 0, 0, 0, 0, 0}));
  table.start_preparing(first);
  table.fail(second, "no reason");
  EXPECT_EQ(counts(), (Counts{1, 1, 0, 0, 1, 0}));
  table.start_rendering(first, std::nullopt, film());
  EXPECT_EQ(table.usage().unfinished_bytes, 2 * image_bytes(order().settings));
  table.complete(first);
  EXPECT_EQ(table.usage().ended_bytes, image_bytes(order().settings));
  EXPECT_EQ(counts(), (Counts{1, 0, 0, 1, 1, 0}));
  table.cancel(third);  // Two are kept that have ended: the one that ended first is forgotten.
  EXPECT_EQ(counts(), (Counts{0, 0, 0, 1, 0, 1}));
  table.remove(first);
  EXPECT_EQ(counts(), (Counts{0, 0, 0, 0, 0, 1}));
  EXPECT_EQ(table.usage().unfinished, 0u);
}

TEST(JobTable, WhatAJobNeedsIsLetGoAtItsEnd) {
  JobTable table({1, 1000, 1ULL << 40});
  auto needs = std::make_shared<int>();
  const std::weak_ptr<int> watched = needs;
  const auto job = table.add(order(), true, std::nullopt, std::move(needs));
  EXPECT_FALSE(watched.expired());
  EXPECT_FALSE(table.add(order(), true, std::nullopt, watched.lock())) << "one that isn't admitted needs nothing";
  EXPECT_EQ(watched.use_count(), 1);
  ASSERT_TRUE(table.cancel(job->id));
  EXPECT_TRUE(watched.expired()) << "though the job is still known";
}

TEST(JobTable, NothingHappensAfterTheEnd) {
  JobTable table(kRoomy);
  const auto job = table.add(order());
  EXPECT_FALSE(job->stop.stop_requested());
  ASSERT_TRUE(table.cancel(job->id));
  EXPECT_TRUE(job->stop.stop_requested());
  EXPECT_FALSE(table.is_unfinished(job->id));
  EXPECT_FALSE(table.start_preparing(job->id));
  EXPECT_FALSE(table.set_plan(job->id, nullptr, nullptr));
  EXPECT_FALSE(table.start_rendering(job->id, std::nullopt, film()));
  EXPECT_FALSE(table.complete(job->id));
  EXPECT_FALSE(table.fail(job->id, "late"));
  EXPECT_EQ(table.cancel(job->id).problem().code, ProblemCode::job_already_ended);
  const JobView view = *table.find(job->id);
  EXPECT_EQ(view.state, JobState::canceled);
  EXPECT_EQ(view.error, "");
  EXPECT_EQ(view.image, proto::ImageState::none);
  EXPECT_EQ(table.film(job->id).problem().code, ProblemCode::image_not_ready);
}

TEST(JobTable, AStateCannotBeSkipped) {
  JobTable table(kRoomy);
  const std::string id = add(table);
  EXPECT_THROW(table.complete(id), std::logic_error);
  EXPECT_TRUE(table.start_preparing(id));
  EXPECT_THROW(table.start_preparing(id), std::logic_error);
}

TEST(JobTable, FailureSaysWhyAndStops) {
  JobTable table(kRoomy);
  const auto job = table.add(order());
  EXPECT_TRUE(table.fail(job->id, "no luck"));
  EXPECT_EQ((*table.find(job->id)).error, "no luck");
  EXPECT_EQ(state(table, job->id), JobState::failed);
  EXPECT_TRUE(job->stop.stop_requested());
}

TEST(JobTable, OnlyWhatHasEndedIsRemoved) {
  JobTable table(kRoomy);
  const std::string id = add(table);
  EXPECT_EQ(table.remove(id)->code, ProblemCode::job_still_active);
  ASSERT_TRUE(table.cancel(id));
  EXPECT_FALSE(table.remove(id));
  EXPECT_EQ(table.remove(id)->code, ProblemCode::not_found);
  EXPECT_EQ(table.find(id).problem().code, ProblemCode::not_found);
  EXPECT_EQ(table.cancel(id).problem().code, ProblemCode::not_found);
  EXPECT_FALSE(table.start_preparing(id));
}

TEST(JobTable, CountsJobsThatHaveNotEnded) {
  JobTable table({2, 1000, 1ULL << 40});
  const std::string first = add(table);
  add(table);
  EXPECT_EQ(table.add(order()).problem().code, ProblemCode::too_many_jobs);
  ASSERT_TRUE(table.cancel(first));
  EXPECT_TRUE(table.add(order()));
}

/// A job that is rendered to its end.
std::string render(JobTable& table) {
  const std::string id = add(table);
  EXPECT_TRUE(table.start_preparing(id) && table.start_rendering(id, std::nullopt, film()) && table.complete(id));
  return id;
}

proto::ImageState image(const JobTable& table, const std::string& id) { return (*table.find(id)).image; }

TEST(JobTable, RefusesWhatUnfinishedJobsLeaveNoMemoryFor) {
  const std::uint64_t one = Film::memory_bytes(10, 10, {});
  JobTable table({1000, 1000, 2 * one});
  EXPECT_FALSE(table.refusal(order().settings));
  const std::string first = add(table), waiting = add(table);
  EXPECT_EQ(table.add(order()).problem().code, ProblemCode::out_of_memory_budget);
  EXPECT_EQ(table.add(order(1, 1)).problem().code, ProblemCode::out_of_memory_budget);
  EXPECT_EQ(table.refusal(order().settings)->code, ProblemCode::out_of_memory_budget);
  ASSERT_TRUE(table.cancel(waiting));  // It never had a film.
  EXPECT_FALSE(table.refusal(order().settings));
  EXPECT_TRUE(table.add(order()));
  ASSERT_TRUE(table.start_preparing(first) && table.start_rendering(first, std::nullopt, film()));
  ASSERT_TRUE(table.complete(first));
  EXPECT_EQ(image(table, first), proto::ImageState::complete);
  EXPECT_TRUE(table.add(order()));
  EXPECT_EQ(image(table, first), proto::ImageState::gone);
  EXPECT_EQ(table.film(first).problem().code, ProblemCode::image_gone);
}

TEST(JobTable, CountsPassesUntilTheirThreadsHaveLeftThem) {
  JobOrder more = order();
  more.settings.samples = 2;
  const std::uint64_t image = image_bytes(more.settings), passes = passes_bytes(more.settings);
  ASSERT_GT(passes, 0U);
  JobTable table({1000, 1000, image + passes});
  auto working = table.add(more);
  ASSERT_TRUE(working);
  ASSERT_TRUE(table.cancel((*working).id));
  EXPECT_EQ(table.add(more).problem().code, ProblemCode::out_of_memory_budget) << "its sums are still there";
  EXPECT_EQ(table.refusal(more.settings)->code, ProblemCode::out_of_memory_budget);
  (*working).passes_memory.reset();
  EXPECT_FALSE(table.refusal(more.settings));
  EXPECT_TRUE(table.add(more));
}

TEST(JobTable, CopiesOfImagesWaitForRoom) {
  const std::uint64_t one = Film::memory_bytes(10, 10, {});
  JobTable table({1000, 1000, 2 * one});
  const std::string first = add(table);
  std::stop_source gone;
  gone.request_stop();  // So that none waits here: it takes what it asks for, or leaves.
  const auto fits = [&] {
    try {
      const JobTable::CopyRoom copy(table, one, gone.get_token());
      return true;
    } catch (const proto::Abandoned&) {
      return false;
    }
  };
  {
    const JobTable::CopyRoom copy(table, one, {});
    EXPECT_FALSE(fits());
  }
  EXPECT_TRUE(fits());
  const std::string second = add(table);
  EXPECT_TRUE(fits()) << "jobs fill all the memory: one can be seen nevertheless";
  ASSERT_TRUE(table.cancel(first) && table.cancel(second));
  const JobTable::CopyRoom copy(table, one, {});
  EXPECT_TRUE(fits()) << "there is room for two";
}

TEST(JobTable, CopiesOfImagesAreCountedWithThem) {
  const std::uint64_t one = Film::memory_bytes(10, 10, {});
  JobTable table({1000, 1000, 2 * one});
  const std::string ended = add(table);
  ASSERT_TRUE(table.start_preparing(ended) && table.start_rendering(ended, std::nullopt, film()));
  ASSERT_TRUE(table.complete(ended));
  const JobTable::CopyRoom copy(table, one, {});
  ASSERT_TRUE(table.add(order())) << "no job is refused for a copy";
  EXPECT_EQ(image(table, ended), proto::ImageState::gone) << "but an image gives way";
}

TEST(JobTable, TheOldestImagesGiveWay) {
  const std::uint64_t one = Film::memory_bytes(10, 10, {});
  JobTable table({1000, 10'000, 3 * one});
  std::vector<std::string> ids;
  for (int i = 0; i < 2000; ++i) ids.push_back(render(table));
  for (std::size_t i = 0; i < ids.size(); ++i) {
    EXPECT_EQ(state(table, ids[i]), JobState::completed);
    EXPECT_EQ(image(table, ids[i]), i < 1997 ? proto::ImageState::gone : proto::ImageState::complete) << i;
  }
  EXPECT_FALSE(table.remove(ids[1999]));
  render(table);
  EXPECT_EQ(image(table, ids[1997]), proto::ImageState::complete) << "what was deleted left room";
  ASSERT_TRUE(table.add(order(10, 20)));
  EXPECT_EQ(image(table, ids[1997]), proto::ImageState::gone);
  EXPECT_EQ(image(table, ids[1998]), proto::ImageState::gone) << "one large image takes two places";
}

TEST(JobTable, WhatACanceledJobRenderedGivesWayToo) {
  JobTable table({1000, 1000, Film::memory_bytes(10, 10, {})});
  const std::string id = add(table);
  ASSERT_TRUE(table.start_preparing(id) && table.start_rendering(id, std::nullopt, film()));
  EXPECT_EQ(image(table, id), proto::ImageState::partial);
  ASSERT_TRUE(table.cancel(id));
  EXPECT_EQ(image(table, id), proto::ImageState::partial);
  EXPECT_TRUE(table.film(id));
  ASSERT_TRUE(table.add(order()));
  EXPECT_EQ(image(table, id), proto::ImageState::gone);
}

TEST(JobTable, AnImageThatIsReadStaysAndCounts) {
  const std::uint64_t one = Film::memory_bytes(10, 10, {});
  JobTable table({1000, 1000, 3 * one});
  const std::string first = render(table), second = render(table), third = render(table);
  auto reading = *table.film(first);
  ASSERT_TRUE(table.add(order()));
  EXPECT_EQ(image(table, first), proto::ImageState::gone);
  EXPECT_EQ(reading->pixels().color.size(), 100U);
  EXPECT_EQ(image(table, second), proto::ImageState::gone) << "the first still takes its place";
  EXPECT_EQ(image(table, third), proto::ImageState::complete);
  reading.reset();
  ASSERT_TRUE(table.add(order()));
  EXPECT_EQ(image(table, third), proto::ImageState::complete) << "now it doesn't";
  reading = *table.film(third);
  EXPECT_TRUE(table.add(order())) << "no job is refused because an image is read";
  EXPECT_FALSE(table.add(order())) << "but because three aren't finished";
}

TEST(JobTable, IsFullWhenAnotherLikeThoseFindsNoRoom) {
  const std::uint64_t one = Film::memory_bytes(10, 10, {});
  JobTable table({1000, 1000, 2 * one + one / 2});
  const Settings large = order(1000, 1000).settings;
  EXPECT_FALSE(table.refusal(large)) << "nothing to do at all";
  add(table);
  EXPECT_FALSE(table.refusal(large));
  add(table);
  EXPECT_EQ(table.refusal(large)->code, ProblemCode::out_of_memory_budget);
  EXPECT_FALSE(table.refusal(order(1, 1).settings));
}

TEST(JobTable, ForgetsWhatEndedFirst) {
  const std::uint64_t one = Film::memory_bytes(10, 10, {});
  JobTable table({1000, 2, 4 * one});
  const std::string first = add(table), second = add(table), third = add(table), waiting = add(table);
  std::weak_ptr<const Film> picture;
  {
    const auto rendered = film();
    picture = rendered;
    ASSERT_TRUE(table.start_preparing(second) && table.start_rendering(second, std::nullopt, rendered));
  }
  ASSERT_TRUE(table.complete(second));
  ASSERT_TRUE(table.fail(third, "no luck"));
  EXPECT_TRUE(table.find(second));
  ASSERT_TRUE(table.cancel(first));  // Came first, but ends last.
  EXPECT_EQ(table.find(second).problem().code, ProblemCode::gone);
  EXPECT_TRUE(picture.expired());
  EXPECT_EQ(state(table, third), JobState::failed);
  EXPECT_EQ(state(table, first), JobState::canceled);
  EXPECT_FALSE(table.remove(third));  // Makes room for one that ends.
  ASSERT_TRUE(table.start_preparing(waiting));
  ASSERT_TRUE(table.cancel(waiting));
  EXPECT_EQ(state(table, first), JobState::canceled);
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(table.add(order())) << "the memory of its film is free";
  table.shut_down();
  EXPECT_EQ(table.list("", 10, std::nullopt).size(), 2U);
}

TEST(JobTable, ListsInOrderOfArrival) {
  JobTable table(kRoomy);
  std::vector<std::string> ids;
  for (int i = 0; i < 300; ++i) ids.push_back(add(table));
  ASSERT_TRUE(table.cancel(ids[7]));
  std::vector<std::string> listed;
  for (std::string after;; after = listed.back()) {
    const auto page = table.list(after, 70, std::nullopt);
    if (page.empty()) break;
    for (const JobView& job : page) listed.push_back(job.id);
  }
  EXPECT_EQ(listed, ids);
  const auto canceled = table.list("", 10, JobState::canceled);
  ASSERT_EQ(canceled.size(), 1U);
  EXPECT_EQ(canceled[0].id, ids[7]);
}

struct CountsEnds final : JobTable::Waiter {
  explicit CountsEnds(JobTable& its_table) : table(its_table) {}
  void told() noexcept override {
    ++ends;
    table.list("", 1, std::nullopt);  // Which the table's lock mustn't be held for.
  }
  JobTable& table;
  int ends = 0;
};

TEST(JobTable, WhoWaitsIsToldOnceOfTheEnd) {
  JobTable table(kRoomy);
  for (int way = 0; way < 4; ++way) {
    const std::string id = add(table);
    CountsEnds a(table), b(table), gone(table);
    for (CountsEnds* waiter : {&a, &gone, &b}) ASSERT_TRUE(table.wait(id, *waiter));
    EXPECT_TRUE(table.stop_waiting(id, gone));
    EXPECT_FALSE(table.stop_waiting(id, gone));
    table.start_preparing(id);
    table.start_rendering(id, std::nullopt, film());
    EXPECT_EQ(a.ends + b.ends, 0);
    if (way == 0) table.complete(id);
    if (way == 1) table.fail(id, "why");
    if (way == 2) {
      EXPECT_TRUE(table.cancel(id));
    }
    if (way == 3) table.shut_down();
    EXPECT_EQ(a.ends, 1) << way;
    EXPECT_EQ(b.ends, 1) << way;
    EXPECT_EQ(gone.ends, 0) << way;
    EXPECT_FALSE(table.stop_waiting(id, a));
    EXPECT_FALSE(table.wait(id, a)) << "it has ended";
    table.cancel(id);
    EXPECT_EQ(a.ends, 1);
  }
  CountsEnds nobody(table);
  EXPECT_FALSE(table.wait("x", nobody));
}

TEST(JobTable, AJobEndsWithItsLastHold) {
  JobTable table(kRoomy);
  const auto is_unfinished_after = [&](bool kept, bool keeps_later) {
    const std::string id = (*table.add(order(), kept)).id;
    auto first = table.hold(id), second = table.hold(id);
    first.reset();
    EXPECT_TRUE(table.is_unfinished(id));
    if (keeps_later) table.keep(id);
    second.reset();
    return table.is_unfinished(id);
  };
  EXPECT_FALSE(is_unfinished_after(false, false));
  EXPECT_TRUE(is_unfinished_after(true, false));
  EXPECT_TRUE(is_unfinished_after(false, true));
  EXPECT_EQ(table.hold("x"), nullptr);
  const std::string id = (*table.add(order(), false)).id;
  const auto held = table.hold(id);
  table.cancel(id);
  EXPECT_EQ(table.remove(id), std::nullopt) << "and what is let go later is nothing";
}

TEST(JobTable, ShuttingDownCancelsAndAdmitsNoMore) {
  JobTable table(kRoomy);
  const auto active = table.add(order());
  const std::string failed = add(table);
  table.fail(failed, "before");
  table.shut_down();
  EXPECT_TRUE(active->stop.stop_requested());
  EXPECT_EQ(state(table, active->id), JobState::canceled);
  EXPECT_EQ(state(table, failed), JobState::failed);
  EXPECT_EQ(table.add(order()).problem().code, ProblemCode::shutting_down);
}

/// An order as the journal takes it.
JobOrder written_order() {
  JobOrder written = order();
  written.document = R"({"scene":")" + written.scene_hash + R"(","image":{"width":10,"height":10}})";
  return written;
}

std::shared_ptr<const void> needs_nothing(const JobOrder&) { return nullptr; }

/// What a daemon that starts then knows; those that hadn't ended are queued again.
std::vector<std::string> restore(const Journal& journal, JobTable& table) {
  for (const JournalEntry& entry : journal.since(0, 1000)) table.restore(entry.job, read_event(entry), entry.seq);
  return table.queue_again(needs_nothing);
}

void await(JobTable& table, const std::string& id, JobTable::Until until = JobTable::Until::ended) {
  struct Awaiting final : JobTable::Waiter {
    void told() noexcept override { promise.set_value(); }
    std::promise<void> promise;
  } awaiting;
  if (table.wait(id, awaiting, until)) awaiting.promise.get_future().get();
}

TEST(JournaledJobs, StayAsTheyAreWhenWhatIsReadCannotHaveHappened) {
  const TemporaryFolder folder;
  std::string id;
  std::vector<JournalEntry> entries;
  {
    Journal journal(folder.path() / "journal.db");
    JobTable table(kRoomy, &journal);
    id = (*table.add(written_order())).id;
    journal.close();
    entries = journal.since(0, 1000);
  }
  JobTable table(kRoomy);
  for (const JournalEntry& entry : entries) table.restore(entry.job, read_event(entry), entry.seq);
  JobEvent::Ended ended{JobState::completed};
  ended.figures.samples = 7;
  EXPECT_ANY_THROW(table.restore(id, {{}, {}, ended}, 100)) << "it hasn't begun to render";
  EXPECT_EQ((*table.find(id)).progress->figures().samples, 0U);
}

TEST(JournaledJobs, NeedWhatTheyNeededAgain) {
  const TemporaryFolder folder;
  std::string id;
  {
    Journal journal(folder.path() / "journal.db");
    JobTable table(kRoomy, &journal);
    id = (*table.add(written_order())).id;
  }
  Journal journal(folder.path() / "journal.db");
  JobTable table(kRoomy, &journal);
  for (const JournalEntry& entry : journal.since(0, 1000)) table.restore(entry.job, read_event(entry), entry.seq);
  auto needs = std::make_shared<int>();
  const std::weak_ptr<int> watched = needs;
  EXPECT_EQ(table.queue_again([&](const JobOrder& order) {
    EXPECT_EQ(order.scene_hash, written_order().scene_hash);
    return std::move(needs);
  }),
            std::vector{id});
  EXPECT_FALSE(watched.expired());
  ASSERT_TRUE(table.cancel(id));
  EXPECT_TRUE(watched.expired());
}

TEST(JournaledJobs, AreThereAgain) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "journal.db";
  std::string completed, failed, canceled, removed, waiting, begun, not_kept;
  JobView ended;
  {
    Journal journal(file);
    JobTable table(kRoomy, &journal);
    const auto add_one = [&] { return (*table.add(written_order())).id; };
    completed = add_one(), failed = add_one(), canceled = add_one(), removed = add_one(), waiting = add_one();
    begun = add_one();
    not_kept = (*table.add(written_order(), false)).id;
    ASSERT_TRUE(table.start_preparing(completed));
    auto plan = std::make_shared<PlanReport>();
    plan->tiles = 4;
    ASSERT_TRUE(table.set_plan(completed, plan, std::make_shared<ObjectMarks>(3)));
    ASSERT_TRUE(table.start_rendering(completed, std::nullopt, film()) && table.complete(completed));
    EXPECT_FALSE(table.is_unfinished(completed)) << "there is nothing left to do, written or not";
    ASSERT_TRUE(table.fail(failed, "no luck"));
    await(table, completed);
    await(table, failed);
    EXPECT_EQ(state(table, completed), JobState::completed);
    ASSERT_TRUE(table.cancel(canceled) && table.cancel(removed));
    EXPECT_EQ(state(table, canceled), JobState::canceled);
    EXPECT_FALSE(table.remove(removed));
    ASSERT_TRUE(table.start_preparing(begun) && table.start_rendering(begun, std::nullopt, film()));
    ended = *table.find(completed);
    table.shut_down();
    EXPECT_EQ(state(table, waiting), JobState::queued) << "it goes on later";
    EXPECT_FALSE(table.is_unfinished(waiting));
  }
  Journal journal(file);
  JobTable table(kRoomy, &journal);
  EXPECT_EQ(restore(journal, table), (std::vector{waiting, begun}));
  EXPECT_EQ(table.find(removed).problem().code, ProblemCode::not_found);
  EXPECT_EQ(table.find(not_kept).problem().code, ProblemCode::not_found);
  EXPECT_EQ(state(table, failed), JobState::failed);
  EXPECT_EQ((*table.find(failed)).error, "no luck");
  EXPECT_EQ(state(table, canceled), JobState::canceled);
  EXPECT_EQ(state(table, begun), JobState::queued);
  const JobView job = *table.find(completed);
  EXPECT_EQ(job.state, JobState::completed);
  EXPECT_EQ(job.plan->tiles, 4U);
  EXPECT_EQ(job.never_tested, 3U);
  EXPECT_EQ(job.order->settings.width, 10U);
  EXPECT_LT(std::chrono::abs(job.times.created - ended.times.created), std::chrono::milliseconds(1));
  // Conversions of clocks and of seconds leave some microseconds.
  EXPECT_LT(std::chrono::abs((*job.times.ended - job.times.queued) - (*ended.times.ended - ended.times.queued)),
            std::chrono::milliseconds(1));
  const auto again = table.take_up(waiting);
  ASSERT_TRUE(again);
  EXPECT_FALSE(again->stop.stop_requested());
  EXPECT_TRUE(table.start_preparing(waiting));
  EXPECT_LT(begun, (*table.add(written_order())).id);
}

using namespace std::chrono_literals;

TEST(JobTable, WhatHasEndedStaysForAWhile) {
  JobTable table(kRoomy);
  const std::string ended = add(table), later = add(table), unfinished = add(table);
  ASSERT_TRUE(table.cancel(ended));
  const auto end = *(*table.find(ended)).times.ended;
  table.look_after({.job_age = 60s}, end + 60s);
  EXPECT_TRUE(table.find(ended)) << "not yet";
  ASSERT_TRUE(table.fail(later, "no luck"));
  table.look_after({}, end + 1000h);
  EXPECT_TRUE(table.find(ended)) << "there is no limit";
  const auto between = end + (*(*table.find(later)).times.ended - end) / 2;
  table.look_after({.job_age = 60s}, between + 60s);
  EXPECT_EQ(table.find(ended).problem().code, ProblemCode::gone);
  EXPECT_EQ(table.cancel(ended).problem().code, ProblemCode::gone);
  EXPECT_TRUE(table.find(later));
  EXPECT_TRUE(table.find(unfinished));
  EXPECT_EQ(table.find("never").problem().code, ProblemCode::not_found);
  ASSERT_FALSE(table.remove(later));
  EXPECT_EQ(table.find(later).problem().code, ProblemCode::not_found) << "who deletes it knows";
}

TEST(JobTable, WorkHasItsTime) {
  JobTable table(kRoomy);
  const std::string queued = add(table), at_work = add(table);
  ASSERT_TRUE(table.start_preparing(at_work));
  const auto begun = *(*table.find(at_work)).times.preparing;
  table.look_after({.work = 10s}, begun + 10s);
  EXPECT_EQ(state(table, at_work), JobState::preparing);
  table.look_after({.work = 10s}, begun + 11s);
  EXPECT_EQ(state(table, at_work), JobState::failed);
  EXPECT_NE((*table.find(at_work)).error.find("--max-job-seconds"), std::string::npos);
  EXPECT_EQ(state(table, queued), JobState::queued) << "waiting isn't work";
}

TEST(JournaledJobs, HowWebhooksStandIsKnownToTheNextDaemonToo) {
  using namespace std::chrono_literals;
  using proto::WebhookState;
  const TemporaryFolder folder;
  std::string tried, done;
  {
    Journal journal(folder.path() / "journal.db");
    JobTable table(kRoomy, &journal);
    const auto add_ended = [&] {
      JobOrder order = written_order();
      order.document.insert(1, R"("webhook":"https://a.b/c",)");
      const std::string id = (*table.add(std::move(order))).id;
      EXPECT_TRUE(table.cancel(id));
      return id;
    };
    tried = add_ended(), done = add_ended();
    EXPECT_TRUE(table.webhook_tried(tried, {WebhookState::pending, "it answered 500", 1h}));
    EXPECT_TRUE(table.webhook_tried(tried, {WebhookState::pending, "it answered 503", 1h}));
    EXPECT_TRUE(table.webhook_tried(done, {WebhookState::pending, "no answer in time", 5s}));
    EXPECT_TRUE(table.webhook_tried(done, {WebhookState::delivered}));
    EXPECT_FALSE(table.webhook_tried("nobody", {WebhookState::delivered}));
  }
  Journal journal(folder.path() / "journal.db");
  JobTable table(kRoomy, &journal);
  restore(journal, table);
  const JobView first = *table.find(tried), second = *table.find(done);
  EXPECT_EQ(first.order->webhook, "https://a.b/c");
  EXPECT_EQ(first.webhook.state, WebhookState::pending);
  EXPECT_EQ(first.webhook.attempts, 2U);
  EXPECT_EQ(first.webhook.error, "it answered 503");
  const auto left = first.webhook.due - JobTimes::Clock::now();
  EXPECT_GT(left, 50min);
  EXPECT_LE(left, 1h + 1s);
  EXPECT_EQ(second.webhook.state, WebhookState::delivered);
  EXPECT_EQ(second.webhook.attempts, 2U);
  EXPECT_EQ(second.webhook.error, "");
}

TEST(JournaledJobs, ImagesGiveWayAndJobsExpireForTheNextDaemonToo) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "journal.db";
  std::vector<std::string> forgotten, jobs;
  const auto forget = [&](const std::string& id) { forgotten.push_back(id); };
  {
    Journal journal(file);
    JobTable table(kRoomy, &journal, forget);
    for (int i = 0; i < 3; ++i) {
      jobs.push_back((*table.add(written_order())).id);
      ASSERT_TRUE(table.start_preparing(jobs[i]) && table.start_rendering(jobs[i], std::nullopt, film()));
      ASSERT_TRUE(table.complete(jobs[i], std::nullopt, {.on_disk = true}));
      await(table, jobs[i]);
    }
    table.look_after({.image_bytes = 2 * image_bytes(written_order().settings)});
    EXPECT_EQ(forgotten, std::vector{jobs[0]}) << "the oldest";
    EXPECT_EQ(image(table, jobs[0]), proto::ImageState::gone);
    EXPECT_EQ(image(table, jobs[1]), proto::ImageState::complete);
    const auto between = *(*table.find(jobs[0])).times.ended + 1ns;
    table.look_after({.job_age = 60s}, between + 60s);
  }
  Journal journal(file);
  JobTable table(kRoomy, &journal, forget);
  restore(journal, table);
  EXPECT_EQ(table.find(jobs[0]).problem().code, ProblemCode::gone);
  EXPECT_EQ(image(table, jobs[1]), proto::ImageState::complete);
  table.look_after({.image_age = 1s}, JobTimes::Clock::now() + 1h);
  EXPECT_EQ(image(table, jobs[2]), proto::ImageState::gone);
}

TEST(JournaledJobs, AreRefusedWhereTheyCannotBeWrittenDown) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "journal.db", aside = folder.path() / "aside.db";
  Journal journal(file);
  JobTable table(kRoomy, &journal);
  const std::string running = (*table.add(written_order())).id, held = (*table.add(written_order(), false)).id;
  const auto hold = table.hold(held);
  ASSERT_TRUE(table.start_preparing(running) && table.start_rendering(running, std::nullopt, film()));
  await(table, running, JobTable::Until::written);
  std::filesystem::rename(file, aside);
  const auto refused = table.add(written_order());
  ASSERT_TRUE(refused);
  await(table, refused->id, JobTable::Until::written);
  ASSERT_TRUE(refused->written.get());
  EXPECT_EQ(refused->written.get()->code, ProblemCode::storage_unavailable);
  EXPECT_TRUE(refused->stop.stop_requested());
  EXPECT_EQ(table.list("", 10, std::nullopt).size(), 2U);
  EXPECT_EQ(table.keep(held).problem().code, ProblemCode::storage_unavailable);
  ASSERT_TRUE(table.complete(running));
  EXPECT_EQ(state(table, running), JobState::rendering) << "nobody is told what a crash would take back";
  std::filesystem::rename(aside, file);
  await(table, running);
  EXPECT_EQ(state(table, running), JobState::completed);
  const auto kept = table.keep(held);
  EXPECT_TRUE(kept && *kept);
}

TEST(JournaledJobs, AreWaitedForUntilTheyAreWrittenDown) {
  const TemporaryFolder folder;
  Journal journal(folder.path() / "journal.db");
  JobTable table(kRoomy, &journal);
  const auto added = table.add(written_order());
  await(table, added->id, JobTable::Until::written);
  EXPECT_FALSE(added->written.get());
  ASSERT_EQ(journal.since(0, 10).size(), 1U);
  struct Never final : JobTable::Waiter {
    void told() noexcept override { FAIL(); }
  } never;
  EXPECT_FALSE(table.wait(added->id, never, JobTable::Until::written)) << "it is so far";
  EXPECT_FALSE(table.wait((*table.add(written_order(), false)).id, never, JobTable::Until::written));
  EXPECT_TRUE(table.wait(added->id, never));
  EXPECT_TRUE(table.stop_waiting(added->id, never));
}

TEST(JournaledJobs, WhatIsKeptLaterHasAllOfItsStory) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "journal.db";
  std::string id;
  {
    Journal journal(file);
    JobTable table(kRoomy, &journal);
    id = (*table.add(written_order(), false)).id;
    const auto hold = table.hold(id);
    ASSERT_TRUE(table.start_preparing(id) && table.set_plan(id, std::make_shared<PlanReport>(), nullptr) &&
                table.start_rendering(id, std::nullopt, film()));
    EXPECT_TRUE(*table.keep(id));
    ASSERT_TRUE(table.complete(id));
    await(table, id);
  }
  Journal journal(file);
  JobTable table(kRoomy, &journal);
  EXPECT_TRUE(restore(journal, table).empty());
  const JobView job = *table.find(id);
  EXPECT_EQ(job.state, JobState::completed);
  EXPECT_TRUE(job.plan && job.times.preparing && job.times.rendering && job.times.ended);
}

TEST(JournaledJobs, TheForgottenStayForgotten) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "journal.db";
  std::string first, second;
  {
    Journal journal(file);
    JobTable table({1000, 1, 1ULL << 40}, &journal);
    first = (*table.add(written_order())).id, second = (*table.add(written_order())).id;
    ASSERT_TRUE(table.cancel(first) && table.cancel(second));
    EXPECT_FALSE(table.find(first));
  }
  Journal journal(file);
  JobTable table(kRoomy, &journal);
  restore(journal, table);
  EXPECT_FALSE(table.find(first));
  EXPECT_TRUE(table.find(second));
}

TEST(JournaledJobs, ImagesOnDiskStayWhenMemoryIsNeeded) {
  const TemporaryFolder folder;
  Journal journal(folder.path() / "journal.db");
  std::vector<std::string> forgotten;
  const std::uint64_t one = Film::memory_bytes(10, 10, {});
  JobTable table({1000, 1000, one}, &journal, [&](const std::string& id) { forgotten.push_back(id); });
  const std::string id = (*table.add(written_order())).id;
  ASSERT_TRUE(table.start_preparing(id) && table.start_rendering(id, std::nullopt, film()));
  EXPECT_FALSE(table.complete(id)) << "its image isn't on disk";
  EXPECT_TRUE(table.is_unfinished(id));
  ASSERT_TRUE(table.complete(id, std::nullopt, {.on_disk = true}));
  await(table, id);
  EXPECT_TRUE(*table.film(id));
  const std::string next = (*table.add(written_order())).id;
  const auto on_disk = table.film(id);
  ASSERT_TRUE(on_disk);
  EXPECT_EQ(*on_disk, nullptr);
  EXPECT_EQ(image(table, id), proto::ImageState::complete);
  ASSERT_TRUE(table.cancel(next));
  auto needs = std::make_shared<int>();
  const std::weak_ptr<int> watched = needs;
  EXPECT_TRUE(table.render_again(id, std::move(needs)));
  EXPECT_EQ(state(table, id), JobState::queued);
  EXPECT_FALSE(watched.expired());
  EXPECT_FALSE(table.render_again(id, nullptr));
  ASSERT_TRUE(table.start_preparing(id) && table.start_rendering(id, std::nullopt, film()));
  ASSERT_TRUE(table.complete(id, std::nullopt, {.on_disk = true}));
  await(table, id);
  EXPECT_TRUE(watched.expired());
  table.let_image_go(id);
  EXPECT_EQ(image(table, id), proto::ImageState::gone);
  EXPECT_EQ(forgotten, std::vector{id});
  EXPECT_FALSE(table.remove(id));
  EXPECT_EQ(forgotten.back(), id);
  JobTable again(kRoomy);
  EXPECT_EQ(restore(journal, again).size(), 0U);
}

TEST(JournaledJobs, ARequestThatIsRepeatedIsKnown) {
  using Is = JobTable::Retry::Is;
  const TemporaryFolder folder;
  const auto file = folder.path() / "journal.db";
  const RetryKey key{"a", "sha256:1"};
  std::string id;
  {
    Journal journal(file);
    JobTable table(kRoomy, &journal);
    {
      const auto claimed = table.claim(key);
      EXPECT_EQ(claimed.is, Is::first);
      EXPECT_EQ(table.claim(key).is, Is::in_progress);
    }
    const auto claimed = table.claim(key);
    EXPECT_EQ(claimed.is, Is::first) << "the other one was refused";
    JobOrder order = written_order();
    order.retry = key;
    id = (*table.add(order)).id;
    EXPECT_EQ(table.claim(key).is, Is::in_progress) << "it isn't answered yet";
  }
  Journal journal(file);
  JobTable table(kRoomy, &journal);
  restore(journal, table);
  EXPECT_EQ(table.claim(key).is, Is::known);
  EXPECT_EQ(table.claim(key).job, id);
  EXPECT_EQ(table.claim({"a", "sha256:2"}).is, Is::another_request);
  ASSERT_TRUE(table.cancel(id));
  EXPECT_FALSE(table.remove(id));
  EXPECT_EQ(table.claim(key).is, Is::first);
}

TEST(Progress, AddsUpEveryKindOfRay) {
  const auto counts = [](std::uint64_t scale) {
    RayCounts rays;
    rays.camera = 1 * scale;
    rays.camera_hits = 2 * scale;
    rays.reflection = 3 * scale;
    rays.refraction = 4 * scale;
    rays.shadow = 5 * scale;
    rays.scattered = 6 * scale;
    rays.camera_skipped = 7 * scale;
    return rays;
  };
  Progress progress;
  progress.add({counts(10), {}, 0}, {});
  progress.add({counts(100), {}, 0}, {counts(10), {}, 0});
  EXPECT_EQ(progress.rays(), counts(100));
}

/// A job of 100 samples that has been rendering for 3 seconds on two threads, and has a quarter of them.
std::pair<JobView, std::shared_ptr<Progress>> job_at_work(JobTable& table, const JobOrder& what) {
  const auto admitted = table.add(what);
  auto plan = std::make_shared<PlanReport>();
  plan->tiles = 4;
  plan->camera_rays = 100;
  EXPECT_TRUE(table.start_preparing(admitted->id) && table.set_plan(admitted->id, plan, nullptr));
  admitted->progress->start_rendering(2);
  EXPECT_TRUE(table.start_rendering(admitted->id, std::nullopt, film()));
  PassReport passes;
  passes.low_total = passes.high_total = 100;
  admitted->progress->set_passes(passes);
  RayCounts rays;
  rays.camera = 25;
  admitted->progress->add({rays, {}, 25}, {});
  return {*table.find(admitted->id), admitted->progress};
}

TEST(JobStatus, TellsThatAJobMayGetMoreOfTheThreads) {
  JobTable table(kRoomy);
  const auto [job, progress] = job_at_work(table, order());
  const auto now = *job.times.rendering + std::chrono::seconds(3);
  const auto all_of_two_threads = std::chrono::seconds(6), a_third = std::chrono::seconds(2);
  progress->add_thread_time(a_third);
  progress->complete_tiles(10'000);  // It isn't that few tiles have been seen.
  const proto::JobStatus beside = status_of(job, now);
  EXPECT_NEAR(*beside.eta, 9, 1e-3);
  EXPECT_LT(beside.eta_range->low, 3);
  progress->add_thread_time(all_of_two_threads - a_third);
  const proto::JobStatus alone = status_of(job, now);
  EXPECT_NEAR(*alone.eta, 9, 1e-3);
  EXPECT_GT(alone.eta_range->low, 6);
  EXPECT_DOUBLE_EQ(alone.eta_range->high, beside.eta_range->high);
}

TEST(JobStatus, AJobThatEndsByTimeTakesThat) {
  JobTable table(kRoomy);
  JobOrder timed = order();
  timed.settings.seconds = 4;
  const auto [job, progress] = job_at_work(table, timed);
  PassReport passes;
  passes.low_total = passes.high_total = 50;
  progress->set_passes(passes);
  const proto::JobStatus status = status_of(job, *job.times.rendering + std::chrono::seconds(3));
  EXPECT_NEAR(*status.eta, 1, 1e-3);
  EXPECT_LT(status.eta_range->low, 1);
  EXPECT_GE(status.eta_range->high, 1);
  EXPECT_LT(status.eta_range->high, 1.2);
}

TEST(JobStatus, WhatAnEarlierDaemonHasRenderedSaysNothingOfTheSpeed) {
  JobTable table(kRoomy);
  const auto [job, progress] = job_at_work(table, order());
  progress->start_rendering(2);
  const auto now = *job.times.rendering + std::chrono::seconds(3);
  EXPECT_EQ(status_of(job, now).eta, std::nullopt);
  RayCounts rays;
  rays.camera = 25;
  progress->add({rays, {}, 25}, {});
  EXPECT_NEAR(*status_of(job, now).eta, 6, 1e-3);
}

TEST(JobStatus, TellsProgressAndWhatIsLeft) {
  JobTable table(kRoomy);
  const auto admitted = table.add(order());
  ASSERT_TRUE(table.start_preparing(admitted->id));
  auto plan = std::make_shared<PlanReport>();
  plan->tiles = 4;
  plan->camera_rays = 80;
  ASSERT_TRUE(table.set_plan(admitted->id, plan, nullptr) && table.start_rendering(admitted->id, std::nullopt, film()));
  JobView job = *table.find(admitted->id);
  const auto now = *job.times.rendering + std::chrono::seconds(3);
  EXPECT_EQ(status_of(job, now).eta, std::nullopt);
  RayCounts rays;
  rays.camera = 20;
  admitted->progress->add({rays, {5, 4, 3, 2, 1}, 25}, {});
  admitted->progress->add_tile({0, 0, 5, 5});
  const proto::JobStatus status = status_of(job, now);
  EXPECT_EQ(status.tiles_done, 1U);
  EXPECT_EQ(status.tiles_total, 4U);
  EXPECT_EQ(status.samples_done, 25U);
  EXPECT_EQ(status.samples_total, 100U);
  EXPECT_NEAR(status.eta.value(), 9, 1e-3);  // And the moment that writing it takes.
  EXPECT_LT(status.eta_range->low, 9);
  EXPECT_GT(status.eta_range->high, 9);
  EXPECT_DOUBLE_EQ(status.progress, 0.25);

  PassReport passes;
  passes.low_total = 50;
  passes.high_total = 100;
  admitted->progress->set_passes(passes);
  const proto::JobStatus ranged = status_of(job, now);
  EXPECT_LT(ranged.eta_range->low, 3);
  EXPECT_GT(ranged.eta_range->high, 9);
  EXPECT_GT(ranged.eta, 3);
  EXPECT_LT(ranged.eta, 9);
  EXPECT_DOUBLE_EQ(ranged.progress_range.low, 0.25);
  EXPECT_DOUBLE_EQ(ranged.progress_range.high, 0.5);
  EXPECT_EQ(job.progress->tests(), (TestCounts{5, 4, 3, 2, 1}));

  // It turns out to be more than it seemed: progress doesn't go back, and its range has it.
  passes.low_total = passes.high_total = 100;
  admitted->progress->set_passes(passes);
  const proto::JobStatus more = status_of(job, now);
  EXPECT_DOUBLE_EQ(more.progress, ranged.progress);
  EXPECT_LE(more.progress_range.low, more.progress);
  EXPECT_GE(more.progress_range.high, more.progress);
  // All samples are there, but the image isn't yet.
  admitted->progress->add({rays, {}, 100}, {rays, {}, 25});
  EXPECT_LT(status_of(job, now).progress, 1);
  ASSERT_TRUE(table.complete(admitted->id));
  EXPECT_EQ(status_of(*table.find(admitted->id), now).progress, 1);
  EXPECT_EQ(status.created.size(), std::string("2024-01-01T00:00:00.000Z").size());
}

TEST(Progress, KnowsTheLastTilesThatAreDone) {
  Progress progress;
  const auto after = [&](std::uint64_t told) { return progress.recent_tiles(told); };
  EXPECT_TRUE(after(0).empty());
  const auto tile = [](int i) { return PixelRect{i, 0, i + 1, 1}; };
  for (int i = 0; i < 3; ++i) progress.add_tile(tile(i));
  EXPECT_EQ(after(0), (std::vector{tile(0), tile(1), tile(2)}));
  EXPECT_EQ(after(2), std::vector{tile(2)});
  EXPECT_TRUE(after(3).empty());
  EXPECT_TRUE(after(100).empty());
  for (int i = 3; i < 200; ++i) progress.add_tile(tile(i));
  EXPECT_EQ(after(0).size(), Progress::kRecentTiles);
  EXPECT_EQ(after(0).back(), tile(199));
  EXPECT_EQ(after(198), (std::vector{tile(198), tile(199)}));
  std::uint64_t told = 198;
  EXPECT_EQ(progress.recent_tiles(told).size(), 2u);
  EXPECT_EQ(told, 200u);
  progress.complete_tiles(300);
  EXPECT_TRUE(after(0).empty());
  EXPECT_EQ(progress.tiles(), 300u);
}

}  // namespace
}  // namespace tessera::server

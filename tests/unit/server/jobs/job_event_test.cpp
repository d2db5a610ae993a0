#include "server/jobs/job_event.h"

#include <limits>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

using namespace std::chrono_literals;

/// What the journal makes of an event.
JobEvent written(const JobEvent& event) {
  return read_event({1, "a", std::string(kind_of(event)), event.time, body_of(event)});
}

const std::string kScene = "sha256:" + std::string(64, 'a');

TEST(JobEvent, AnOrderIsWhatItsDocumentSays) {
  auto order = std::make_shared<JobOrder>();
  order->document = R"({"scene":")" + kScene +
                    R"(","image":{"width":7,"height":9},"name":"\u00e9","priority":"high","webhook":"https://a.b/c?d",)"
                    R"("settings":{"samples":3,"seed":18446744073709551615,"aovs":["depth"],"tile_size":"whole"}})";
  order->need = {kScene + " 8", 5, 6};
  order->warnings = 2;
  order->parsing = 1500us;
  const JobEvent event{std::chrono::system_clock::time_point(1234567ms), 0s, JobEvent::Queued{order}};
  EXPECT_EQ(kind_of(event), "queued");
  const JobEvent again = written(event);
  EXPECT_EQ(again.time, event.time);
  const JobOrder& read = *std::get<JobEvent::Queued>(again.what).order;
  EXPECT_EQ(read.name, "\u00e9");
  EXPECT_EQ(read.priority, proto::Priority::high);
  EXPECT_EQ(read.webhook, "https://a.b/c?d");
  EXPECT_EQ(read.scene_hash, kScene);
  EXPECT_EQ(read.settings.width, 7U);
  EXPECT_EQ(read.settings.height, 9U);
  EXPECT_EQ(read.settings.samples, 3U);
  EXPECT_EQ(read.settings.seed, 18446744073709551615ULL);
  EXPECT_EQ(read.settings.aovs, std::set<Aov>{Aov::depth});
  EXPECT_EQ(read.settings.tile_size, 9U);
  EXPECT_EQ(read.need.shared_key, order->need.shared_key);
  EXPECT_EQ(read.need.shared_bytes, 5U);
  EXPECT_EQ(read.need.own_bytes, 6U);
  EXPECT_EQ(read.warnings, 2U);
  EXPECT_EQ(read.parsing, order->parsing);
}

TEST(JobEvent, LimitsOfTodayAreNoneOfAnOrderThatWasAccepted) {
  const auto job = read_order_document(R"({"scene":")" + kScene +
                                       R"(","image":{"width":1000000,"height":1000000},)"
                                       R"("settings":{"samples":4000000}})");
  ASSERT_TRUE(job) << job.problem().detail;
  EXPECT_EQ(job->settings.samples, 4000000U);
}

TEST(JobEvent, ATryToDeliverAWebhookSaysWhatFollows) {
  const JobEvent event{{}, 3s, JobEvent::WebhookTried{proto::WebhookState::pending, "it answered 500", 1500ms}};
  EXPECT_EQ(kind_of(event), "webhook");
  EXPECT_EQ(step_of(event), std::nullopt);
  const JobEvent again = written(event);
  const auto& tried = std::get<JobEvent::WebhookTried>(again.what);
  EXPECT_EQ(again.age, 3s);
  EXPECT_EQ(tried.state, proto::WebhookState::pending);
  EXPECT_EQ(tried.error, "it answered 500");
  EXPECT_EQ(tried.delay, 1500ms);
  const JobEvent end = written({{}, 0s, JobEvent::WebhookTried{proto::WebhookState::delivered}});
  EXPECT_EQ(std::get<JobEvent::WebhookTried>(end.what).state, proto::WebhookState::delivered);
  EXPECT_EQ(std::get<JobEvent::WebhookTried>(end.what).error, "");
}

TEST(JobEvent, AnEndHasItsFiguresToTheLastBit) {
  JobEvent::Ended ended{proto::JobState::completed};
  ended.figures.rays = {1, 2, 3, 4, 5, 6, 7};
  ended.figures.tests = {8, 9, 10, 11, std::numeric_limits<std::uint64_t>::max()};
  ended.figures.samples = 12;
  ended.figures.tiles = 13;
  ended.figures.broken_textures = 14;
  ended.figures.passes = {
      15, 16, 17, 18, 19, 20, ErrorEstimate{0.1, 1.0 / 3, std::numeric_limits<double>::infinity()}, EndedBy::error};
  StructureUse use{{}, {}, 0.7, true};
  use.options.kind = AccelKind::bvh;
  use.options.bound = BoundKind::slabs;
  use.options.normals = {{0.1F, 0.2F, 0.3F}, {1, 0, 0}};
  use.options.leaf_size = 5;
  use.stats = {21, 22, 23, 24, 25, 26, 27, 0.3};
  ended.structure = use;
  const auto marks = std::make_shared<ObjectMarks>(5);
  marks->mark(1);
  ended.tested = marks;
  const JobEvent again = written({{}, 1234567us, ended});
  EXPECT_EQ(again.age, 1234567us);
  const auto& read = std::get<JobEvent::Ended>(again.what);
  EXPECT_EQ(read.state, proto::JobState::completed);
  EXPECT_EQ(read.figures.rays, ended.figures.rays);
  EXPECT_EQ(read.figures.tests, ended.figures.tests);
  EXPECT_EQ(read.figures.samples, 12U);
  EXPECT_EQ(read.figures.tiles, 13U);
  EXPECT_EQ(read.figures.broken_textures, 14U);
  const PassReport& passes = read.figures.passes;
  EXPECT_EQ(passes.passes, 15U);
  EXPECT_EQ(passes.least, 16U);
  EXPECT_EQ(passes.most, 17U);
  EXPECT_EQ(passes.samples, 18U);
  EXPECT_EQ(passes.low_total, 19U);
  EXPECT_EQ(passes.high_total, 20U);
  ASSERT_TRUE(passes.error);
  EXPECT_EQ(passes.error->error, 0.1);
  EXPECT_EQ(passes.error->low, 1.0 / 3);
  EXPECT_EQ(passes.error->high, std::numeric_limits<double>::infinity());
  EXPECT_EQ(passes.ended_by, EndedBy::error);
  ASSERT_TRUE(read.structure);
  EXPECT_EQ(read.structure->options, use.options);
  EXPECT_EQ(read.structure->build_seconds, 0.7);
  EXPECT_TRUE(read.structure->shared);
  EXPECT_EQ(read.structure->stats.bytes, 21U);
  EXPECT_EQ(read.structure->stats.depth, 24U);
  EXPECT_EQ(read.structure->stats.meshes_loaded, 27U);
  EXPECT_EQ(read.structure->stats.mesh_seconds, 0.3);
  EXPECT_EQ(read.never_tested, 4U);
}

TEST(JobEvent, AFailureSaysWhyWhateverTheBytes) {
  const JobEvent again = written({{}, 0s, JobEvent::Ended{proto::JobState::failed, "no \xFF luck"}});
  EXPECT_EQ(std::get<JobEvent::Ended>(again.what).state, proto::JobState::failed);
  EXPECT_EQ(std::get<JobEvent::Ended>(again.what).error, "no \uFFFD luck");
}

TEST(JobEvent, APlanIsTheSame) {
  auto plan = std::make_shared<PlanReport>();
  *plan = PlanReport{};
  plan->accel.kind = AccelKind::wide;
  plan->accel_because = "of it";
  plan->candidates = {{plan->accel, 0.25, std::numeric_limits<double>::infinity()}};
  plan->needs_structure = true;
  plan->tiles = 3;
  plan->camera_rays = 17;
  plan->skips = {{"shadow_rays", "there is no light", 5}};
  const JobEvent again = written({{}, 0s, JobEvent::Planned{plan}});
  const PlanReport& read = *std::get<JobEvent::Planned>(again.what).plan;
  EXPECT_EQ(read.accel.kind, AccelKind::wide);
  EXPECT_EQ(read.accel_because, "of it");
  ASSERT_EQ(read.candidates.size(), 1U);
  EXPECT_EQ(read.candidates[0].build_seconds, 0.25);
  EXPECT_EQ(read.candidates[0].trace_seconds, std::numeric_limits<double>::infinity());
  EXPECT_TRUE(read.needs_structure);
  EXPECT_EQ(read.tiles, 3U);
  EXPECT_EQ(read.camera_rays, 17U);
  ASSERT_EQ(read.skips.size(), 1U);
  EXPECT_EQ(read.skips[0].what, "shadow_rays");
  EXPECT_EQ(read.skips[0].count, 5U);
}

TEST(JobEvent, WhatIsNoneIsRefused) {
  EXPECT_ANY_THROW(read_event({1, "a", "queued", {}, "{"}));
  EXPECT_ANY_THROW(read_event({1, "a", "exploded", {}, R"({"age":0})"}));
  EXPECT_ANY_THROW(read_event({1, "a", "completed", {}, R"({"age":0})"}));
  EXPECT_ANY_THROW(read_event({1, "a", "rendering", {}, R"({"age":0,"structure":{"options":{"kind":"no"}}})"}));
}

TEST(JobEvent, ValuesThatCannotBeAreRefused) {
  const std::string whole = body_of({{}, 0s, JobEvent::Ended{proto::JobState::failed}});
  EXPECT_NO_THROW(read_event({1, "a", "failed", {}, whole}));
  const auto is_refused = [&](const std::string& from, const std::string& to) {
    std::string body = whole;
    body.replace(body.find(from), from.size(), to);
    EXPECT_ANY_THROW(read_event({1, "a", "failed", {}, body})) << body;
  };
  is_refused(R"("age":0.0)", R"("age":1e300)");
  is_refused(R"("age":0.0)", R"("age":-1e300)");
  is_refused(R"("samples":0)", R"("samples":-1)");
  is_refused(R"("samples":0)", R"("samples":1e300)");
  is_refused(R"("passes":0)", R"("passes":4294967296)");
  is_refused(R"("ended_by":null)", R"("ended_by":"luck")");
  is_refused(R"("age":0.0)", R"("age":0,"x":)" + std::string(10'000, '[') + std::string(10'000, ']'));
  EXPECT_ANY_THROW(read_event({1, "a", "preparing", std::chrono::system_clock::time_point(-1ms), R"({"age":0})"}));
  EXPECT_FALSE(
      read_order_document(R"({"scene":")" + kScene + R"(","image":{"width":4294967295,"height":4294967295}})"));
}

}  // namespace
}  // namespace tessera::server

#include "proto/wire/job_status.h"

#include <cstdint>
#include <limits>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tessera::proto {
namespace {

JobStatus sample() {
  return {.id = "j1",
          .name = "night",
          .priority = "low",
          .state = JobState::rendering,
          .image = ImageState::partial,
          .scene = "sha256:00",
          .width = 640,
          .height = 480,
          .tiles_done = 3,
          .tiles_total = 80,
          .samples_done = 1000,
          .samples_total = 307200,
          .progress = 0.25,
          .progress_range = {0.125, 0.5},
          .passes = 2,
          .samples_per_pixel = {1, 2.5, 4},
          .achieved = Achieved{0.02, {0.018, 0.023}},
          .ended_by = "error",
          .elapsed = 0.5,
          .eta = 12.5,
          .eta_range = Range{10, 20},
          .created = "2024-01-01T00:00:00Z",
          .error = "",
          .warnings = 2,
          .webhook = WebhookStatus{"hooks.example.org", WebhookState::failed, 11, "it answered 500"}};
}

TEST(JobStatus, SurvivesTheWire) {
  const nlohmann::json json = to_json(sample());
  const auto back = job_status(json);
  ASSERT_TRUE(back);
  EXPECT_EQ(to_json(*back), json);
  EXPECT_EQ(back->state, JobState::rendering);
  EXPECT_EQ(json["image"], "partial");
  EXPECT_EQ(back->image, ImageState::partial);
  EXPECT_EQ(back->eta, 12.5);

  EXPECT_EQ(back->progress_range.high, 0.5);
  EXPECT_EQ(back->samples_per_pixel.most, 4U);
  EXPECT_EQ(back->achieved->interval.low, 0.018);
  EXPECT_EQ(back->eta_range->high, 20);
  EXPECT_EQ(back->webhook->state, WebhookState::failed);
  EXPECT_EQ(back->webhook->attempts, 11U);

  JobStatus fresh = sample();
  fresh.eta.reset();
  fresh.achieved.reset();
  fresh.webhook.reset();
  EXPECT_FALSE(to_json(fresh).contains("eta"));
  EXPECT_FALSE(to_json(fresh).contains("achieved"));
  EXPECT_FALSE(to_json(fresh).contains("webhook"));
  EXPECT_EQ(job_status(to_json(fresh))->eta, std::nullopt);
}

TEST(JobStatus, ItsTextIsJsonWhateverStandsInIt) {
  JobStatus odd = sample();
  odd.name = "\"quoted\" \\ \n\t\x01 é 日 \x7f";
  odd.error = "not UTF-8: \xff";
  odd.samples_total = std::numeric_limits<std::uint64_t>::max();
  odd.width = std::numeric_limits<std::uint32_t>::max();
  odd.progress = 5e-324;
  odd.elapsed = std::numeric_limits<double>::max();
  odd.eta = std::numeric_limits<double>::infinity();
  odd.samples_per_pixel.mean = 1;
  const nlohmann::json json = nlohmann::json::parse(json_text(odd));
  EXPECT_EQ(json["name"], odd.name);
  EXPECT_EQ(json["error"], "not UTF-8: \uFFFD");
  EXPECT_EQ(json["samples_total"], odd.samples_total);
  EXPECT_EQ(json["width"], odd.width);
  EXPECT_EQ(json["progress"], odd.progress);
  EXPECT_EQ(json["elapsed"], odd.elapsed);
  EXPECT_TRUE(json["eta"].is_null());
  EXPECT_TRUE(json["samples_per_pixel"]["mean"].is_number_float());
  EXPECT_EQ(json["progress_range"], nlohmann::json::array({0.125, 0.5}));
}

TEST(JobStatus, NothingForAFieldThatIsMissingOrWrong) {
  const std::set<std::string> optional{"eta", "eta_range", "achieved", "ended_by", "webhook"};
  const nlohmann::json good = to_json(sample());
  for (const auto& [key, value] : good.items()) {
    nlohmann::json missing = good;
    missing.erase(key);
    EXPECT_EQ(job_status(missing).has_value(), optional.contains(key)) << key;
    nlohmann::json wrong = good;
    wrong[key] = nlohmann::json::array();
    EXPECT_FALSE(job_status(wrong)) << key;
  }
  nlohmann::json inside = good;
  inside["achieved"]["interval"] = {1, 2, 3};
  EXPECT_FALSE(job_status(inside));
  nlohmann::json wide = good;
  wide["width"] = 1ULL << 32;
  EXPECT_FALSE(job_status(wide));
  EXPECT_FALSE(job_status(nlohmann::json::array()));
}

TEST(JobStatus, FieldsOfLaterVersionsDoNotHurt) {
  nlohmann::json json = to_json(sample());
  json["colour"] = "blue";
  EXPECT_TRUE(job_status(json));
}

TEST(JobState, EveryNameComesBack) {
  for (int i = 0; i <= static_cast<int>(JobState::canceled); ++i) {
    const auto state = static_cast<JobState>(i);
    EXPECT_EQ(job_state(name(state)), state);
  }
  EXPECT_EQ(job_state("done"), std::nullopt);
}

}  // namespace
}  // namespace tessera::proto

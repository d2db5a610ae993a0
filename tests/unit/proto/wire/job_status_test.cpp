#include "proto/wire/job_status.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tessera::proto {
namespace {

JobStatus sample() {
  return {.id = "j1",
          .name = "night",
          .state = JobState::rendering,
          .image = ImageState::partial,
          .scene = "sha256:00",
          .width = 640,
          .height = 480,
          .tiles_done = 3,
          .tiles_total = 80,
          .samples_done = 1000,
          .samples_total = 307200,
          .elapsed = 0.5,
          .eta = 12.5,
          .created = "2024-01-01T00:00:00Z",
          .error = "",
          .warnings = 2};
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

  JobStatus fresh = sample();
  fresh.eta.reset();
  EXPECT_FALSE(to_json(fresh).contains("eta"));
  EXPECT_EQ(job_status(to_json(fresh))->eta, std::nullopt);
}

TEST(JobStatus, NothingForAFieldThatIsMissingOrWrong) {
  const nlohmann::json good = to_json(sample());
  for (const auto& [key, value] : good.items()) {
    nlohmann::json missing = good;
    missing.erase(key);
    EXPECT_EQ(job_status(missing).has_value(), key == "eta") << key;
    nlohmann::json wrong = good;
    wrong[key] = nlohmann::json::array();
    EXPECT_FALSE(job_status(wrong)) << key;
  }
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

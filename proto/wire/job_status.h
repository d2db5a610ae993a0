#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace tessera::proto {

/// queued → preparing → rendering → completed | failed | canceled.
enum class JobState { queued, preparing, rendering, completed, failed, canceled };

std::string_view name(JobState state);
std::optional<JobState> job_state(std::string_view name);
constexpr bool has_ended(JobState s) { return s >= JobState::completed; }

/// What there is of a job's image: nothing yet, or ever, of one that ended early; what has been rendered; all of it;
/// nothing any more, because it gave way to the images of younger jobs.
enum class ImageState { none, partial, complete, gone };

std::string_view name(ImageState state);

struct Range {
  double low = 0, high = 0;
};

/// An image's error, and the interval that holds it in 95 of 100 cases.
struct Achieved {
  double error = 0;
  Range interval;
};

/// Whether a job's webhook has been delivered: not yet, yes, or not, and it isn't tried any more.
enum class WebhookState { pending, delivered, failed };

std::string_view name(WebhookState state);
std::optional<WebhookState> webhook_state(std::string_view name);

/// How a job's webhook stands. The path and the query of its URL may hold a secret, and aren't told.
struct WebhookStatus {
  std::string host;  ///< And port, as they stand in the URL.
  WebhookState state = WebhookState::pending;
  std::uint32_t attempts = 0;
  std::string error;  ///< Why the last of them failed; empty otherwise.
};

struct SamplesPerPixel {
  std::uint32_t least = 0;
  double mean = 0;
  std::uint32_t most = 0;
};

/// What `GET /v1/jobs/{id}` says. Times are seconds; `eta` and its range are absent unless it renders and has traced a
/// ray.
struct JobStatus {
  std::string id;
  std::string name;                 ///< As the user gave it; may be empty.
  std::string priority = "normal";  ///< One of `priority_names()`.
  JobState state = JobState::queued;
  ImageState image = ImageState::none;
  std::string scene;  ///< Content hash.
  std::uint32_t width = 0, height = 0;
  std::uint64_t tiles_done = 0, tiles_total = 0;
  std::uint64_t samples_done = 0, samples_total = 0;  ///< The total is the most that there may be.
  double progress = 0;                                ///< The part of the work that is done, 0..1, as far as is known,
  Range progress_range;                               ///< and between which bounds.
  std::uint32_t passes = 0;                           ///< That are complete.
  SamplesPerPixel samples_per_pixel;                  ///< After those.
  std::optional<Achieved> achieved;                   ///< Likewise; absent where the error isn't measured.
  std::optional<std::string> ended_by;                ///< "samples", "error" or "seconds"; absent until it completes.
  double elapsed = 0;                                 ///< From acceptance to the end, or to now.
  std::optional<double> eta;
  std::optional<Range> eta_range;
  std::string created;  ///< RFC 3339, UTC.
  std::string error;    ///< Why it failed; empty otherwise.
  std::uint64_t warnings = 0;
  std::optional<WebhookStatus> webhook;  ///< Of a job that has one.
};

/// As JSON, without an end of line. What isn't UTF-8 is replaced (U+FFFD).
std::string json_text(const JobStatus& status);
nlohmann::json to_json(const JobStatus& status);

/// Nothing when a field is missing or of the wrong type. Fields that it doesn't know are left to later versions.
std::optional<JobStatus> job_status(const nlohmann::json& json);

}  // namespace tessera::proto

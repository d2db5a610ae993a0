#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <spdlog/spdlog.h>

#include "server/handlers/asset.h"
#include "server/handlers/handlers.h"
#include "server/handlers/image_choice.h"
#include "server/handlers/job_draft.h"
#include "server/handlers/picture.h"
#include "server/handlers/preference.h"
#include "server/jobs/job_table.h"
#include "server/jobs/known_jobs.h"

namespace tessera::server {
using proto::ImageState;
using proto::JobState;
using proto::Problem;
using proto::ProblemCode;
using proto::Result;

namespace {

using Clock = JobTimes::Clock;

/// A job whose image is wanted, and what of it.
struct Wanted {
  std::string job;
  ImageDefaults defaults;
  std::string identity;  ///< What the pixels depend on.
  Preference preference;
  unsigned attempt;
};

Response render(Services& services, Request& request, unsigned attempt);

/// Once more, when an image has given way to those of others before it could be sent.
Response render_again(Services& services, Request& request, const Wanted& wanted) {
  if (wanted.attempt < kMostAttempts) return render(services, request, wanted.attempt + 1);
  return problem_response(gave_way());
}

void add_timing(std::string& text, const char* name, Clock::duration time) {
  char entry[64];
  std::snprintf(entry, sizeof entry, "%s%s;dur=%.3f", text.empty() ? "" : ", ", name,
                std::chrono::duration<double, std::milli>(time).count());
  text += entry;
}

/// How long the steps of a job have taken (https://www.w3.org/TR/server-timing/), in milliseconds.
std::string timing_of(const JobView& job, Clock::duration encoding) {
  const JobTimes& times = job.times;
  std::string text;
  add_timing(text, "parse", job.order->parsing);
  if (times.preparing) add_timing(text, "queue", *times.preparing - times.queued);
  if (times.preparing && times.rendering) add_timing(text, "build", *times.rendering - *times.preparing);
  if (times.rendering && times.ended) add_timing(text, "render", *times.ended - *times.rendering);
  add_timing(text, "encode", encoding);
  return text;
}

Problem ended_early(const JobView& job, bool shutting_down) {
  if (job.state == JobState::failed)
    return {ProblemCode::internal_error, "The job " + job.id + " failed: " + job.error + ".", {}};
  if (shutting_down)
    return {ProblemCode::shutting_down, "The server is about to stop; send the request again soon.", {}};
  return {ProblemCode::image_not_ready, "The job " + job.id + " was canceled before its image was complete.", {}};
}

Response accepted(const JobView& job, const Preference& preference) {
  Response response = json_text_response(202, json_text(status_of(job, Clock::now())));
  response.headers.emplace_back("Preference-Applied", preference.applied());
  return response;
}

/// Has the job go on when its client doesn't wait any more. False when it has ended meanwhile.
Result<bool> keep(Services& services, Request& request, const JobView& job) {
  const auto asset = open_asset(services, request);
  if (!asset) return asset.problem();
  const auto draft = draft_job(request, *asset);
  if (!draft) return draft.problem();
  return keep_job(services, *asset, *draft, job, request.abandoned);
}

/// The image, as soon as there is one.
Response answer(Services& services, Request& request, const Wanted& wanted) {
  const auto job = services.jobs.find(wanted.job);
  if (!job) return render_again(services, request, wanted);  // It has been forgotten meanwhile,
  Response response;
  if (!proto::has_ended(job->state)) {
    if (services.shutting_down) return problem_response(ended_early(*job, true));
    const auto kept = keep(services, request, *job);
    if (!kept) return problem_response(kept.problem());
    if (!*kept) return answer(services, request, wanted);
    response = accepted(*job, wanted.preference);
  } else if (job->state != JobState::completed) {
    response = problem_response(ended_early(*job, services.shutting_down));
  } else {
    const auto choice = choose_image(request, job->order->settings, wanted.defaults);
    if (!choice) return problem_response(choice.problem());
    if (job->image == ImageState::gone && !is_encoded(services, job->id, *choice))
      return render_again(services, request, wanted);  // or its image has given way.
    const auto begin = Clock::now();
    response = picture_response(services, request, *job, *choice, wanted.identity);
    response.headers.emplace_back("Server-Timing", timing_of(*job, Clock::now() - begin));
    if (const std::uint64_t warnings = status_of(*job, Clock::now()).warnings; warnings > 0) {
      response.headers.emplace_back("Tessera-Warnings", std::to_string(warnings));
      response.headers.emplace_back("Link", "</v1/scenes/" + job->order->scene_hash + ">; rel=\"describedby\"");
    }
  }
  response.headers.emplace_back("Location", "/v1/jobs/" + job->id);
  return response;
}

/// Whether a job that was made before still has what is asked for, or will have.
bool is_of_use(Services& services, const Request& request, const JobView& job, const JobDraft& draft) {
  if (job.image != ImageState::gone) return true;
  const auto choice = choose_image(request, job.order->settings, draft.image);
  return !choice || is_encoded(services, job.id, *choice);
}

Response render(Services& services, Request& request, unsigned attempt) {
  const auto begin = Clock::now();
  const auto asset = open_asset(services, request);
  if (!asset) return problem_response(asset.problem());
  const auto draft = draft_job(request, *asset);
  if (!draft) return problem_response(draft.problem());
  // What can be refused before anything is parsed, is; so is what the client has.
  const auto expected = choose_image(request, draft->expected, draft->image);
  if (!expected) return problem_response(expected.problem());
  const bool is_reproducible = !draft->is_timed && !draft->names_paths;
  if (is_reproducible) {
    const std::string etag = picture_etag(draft->key, *expected);
    if (is_known(request, etag)) return {304, {{"ETag", etag}, {"Vary", "Accept"}, {"Cache-Control", "no-cache"}}, ""};
  }

  const auto has_it = [&](const JobView& job) { return is_of_use(services, request, job, *draft); };
  const auto held = find_or_start(services, *asset, *draft, request.who, has_it, request.abandoned);
  if (!held) return problem_response(held.problem());
  const Wanted wanted{held->id, draft->image, is_reproducible ? draft->key : held->id, read_preference(request),
                      attempt};
  const auto job = services.jobs.find(held->id);
  if (!job) return render_again(services, request, wanted);
  const auto choice = choose_image(request, job->order->settings, draft->image);
  if (!choice) return problem_response(choice.problem());
  const auto until = wanted.preference.until(begin);
  if (proto::has_ended(job->state) || (until && *until <= Clock::now())) return answer(services, request, wanted);
  spdlog::debug("job {}: wanted", held->id);
  const auto go_on = [wanted](Services& its_services, Request& its_request) {
    return answer(its_services, its_request, wanted);
  };
  Response response;
  response.later = std::make_shared<const Later>(Later{held->id, until, held->hold, go_on});
  return response;
}

}  // namespace

Response post_render(Services& services, Request& request) { return render(services, request, 1); }

}  // namespace tessera::server

#include <charconv>
#include <optional>
#include <stop_token>
#include <string>

#include <nlohmann/json.hpp>

#include "core/scene/frame_scene.h"
#include "proto/parse.h"
#include "server/blob_store.h"
#include "server/config.h"
#include "server/handlers/handlers.h"
#include "server/image_cache.h"
#include "server/image_choice.h"
#include "server/job_runner.h"
#include "server/job_table.h"
#include "server/lane.h"
#include "server/query_errors.h"
#include "server/scene_store.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

namespace {

constexpr std::size_t kDefaultListed = 100;
constexpr std::size_t kMostListed = 1000;
/// Of a scene that is looked through, for a camera say, in the quick lane.
constexpr std::size_t kQuickObjects = 10'000;

nlohmann::json status_json(const JobView& job) { return to_json(status_of(job, JobTimes::Clock::now())); }

/// A problem of the scene that a job names by hash, as one of the job's document: places in the stored scene are
/// none in that.
Problem at_scene(const Problem& problem) {
  if (problem.code == ProblemCode::out_of_memory_budget || problem.code == ProblemCode::internal_error) return problem;
  const std::string& why = problem.errors.empty() ? problem.detail : problem.errors.front().detail;
  constexpr const char* kUnusable = "The scene that this job names can't be used.";
  return {ProblemCode::invalid_document, kUnusable, {{"/scene", kUnusable + (' ' + why)}}};
}

proto::Result<proto::ParsedScene> scene_of(SceneStore& scenes, proto::JobRequest& job,
                                           const std::stop_token& abandoned) {
  if (auto* parsed = std::get_if<proto::ParsedScene>(&job.scene)) return scenes.share(std::move(*parsed));
  auto found = scenes.find(std::get<proto::ContentHash>(job.scene), abandoned);
  if (!found) return at_scene(found.problem());
  return found;
}

/// An image that wouldn't fit if there were no other: waiting doesn't help.
std::optional<Problem> refuse_size(const Settings& settings, const Config& config) {
  const std::uint64_t bytes = image_bytes(settings) + passes_bytes(settings);
  if (bytes <= config.max_film_memory) return std::nullopt;
  return Problem{
      ProblemCode::invalid_document,
      "The image is too large for this server.",
      {{"/image", "Its " + std::to_string(bytes) + " bytes exceed the " + std::to_string(config.max_film_memory) +
                      " that the server has for images; ask for fewer pixels or AOVs."}}};
}

/// An image that would be rendered and then couldn't be fetched, or a plane of it.
std::optional<Problem> refuse_without_format(const Settings& settings) {
  Problem problem{ProblemCode::invalid_document, "No image format can hold this image.", {}};
  for (const PlaneEntry& plane : plane_table()) {
    const bool is_rendered =
        plane.plane == kColorPlane || (plane.plane.aov && settings.aovs.contains(*plane.plane.aov));
    if (!is_rendered || !able_formats(plane.plane, settings).empty()) continue;
    problem.errors.push_back({"/image", (plane.name.empty() ? "Its colour" : "Its " + std::string(plane.name)) +
                                            " fits into no format; make width or height smaller."});
  }
  if (problem.errors.empty()) return std::nullopt;
  return problem;
}

std::optional<std::size_t> read_limit(const Request& request) {
  const auto text = request.query("limit");
  if (!text) return kDefaultListed;
  std::size_t limit = 0;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), limit);
  if (error != std::errc() || end != text->data() + text->size() || limit < 1 || limit > kMostListed)
    return std::nullopt;
  return limit;
}

}  // namespace

Response post_job(Services& services, Request& request) {
  auto job = proto::parse_job(request.body, services.blobs, services.config.documents, request.abandoned);
  if (!job) return problem_response(job.problem());
  const auto scene = scene_of(services.scenes, *job, request.abandoned);
  if (!scene) return problem_response(scene.problem());
  if (FileBudget::is_limited() && scene->scene->objects.size() > kQuickObjects) throw TooHeavy{};
  if (const auto problem = fit_to_scene(*scene->scene, services.config.documents, *job))
    return problem_response(*problem);
  if (const auto problem = refuse_size(job->settings, services.config)) return problem_response(*problem);
  if (const auto problem = refuse_without_format(job->settings)) return problem_response(*problem);

  const std::optional<Camera>& wanted = job->camera ? job->camera : scene->scene->camera;
  const Camera camera =
      frame_scene(*scene->scene, job->settings.width, job->settings.height, wanted.value_or(kUnplacedCamera));

  // From here on whatever fails, fails the job.
  const JobOrder order{job->name, scene->hash, scene->scene->warnings.size(), job->settings};
  const auto admitted = services.jobs.add(order);
  if (!admitted) return problem_response(admitted.problem());
  services.runner.start(*admitted, order, scene->scene, camera);

  const auto view = services.jobs.find(admitted->id);
  Response response = view ? json_response(201, status_json(*view)) : problem_response(view.problem());
  response.headers.emplace_back("Location", "/v1/jobs/" + admitted->id);
  return response;
}

Response list_jobs(Services& services, Request& request) {
  const auto limit = read_limit(request);
  const auto state_name = request.query("state");
  const auto state = state_name ? proto::job_state(*state_name) : std::nullopt;
  QueryErrors errors;
  if (!limit) errors.add("limit", "Give a number from 1 to " + std::to_string(kMostListed) + ".");
  if (state_name && !state)
    errors.add("state", "Give one of queued, preparing, rendering, completed, failed and canceled.");
  if (!errors.empty()) return problem_response(std::move(errors).as_problem());

  auto jobs = services.jobs.list(request.query("after").value_or(""), *limit + 1, state);
  nlohmann::json body{{"jobs", nlohmann::json::array()}};
  if (jobs.size() > *limit) {
    jobs.pop_back();
    body["next"] = jobs.back().id;
  }
  for (const JobView& job : jobs) body["jobs"].push_back(status_json(job));
  return json_response(200, body);
}

Response show_job(Services& services, Request& request) {
  const auto job = services.jobs.find(request.parameter);
  return job ? json_response(200, status_json(*job)) : problem_response(job.problem());
}

Response cancel_job(Services& services, Request& request) {
  const auto job = services.jobs.cancel(request.parameter);
  return job ? json_response(202, status_json(*job)) : problem_response(job.problem());
}

Response delete_job(Services& services, Request& request) {
  if (const auto problem = services.jobs.remove(request.parameter)) return problem_response(*problem);
  services.images.drop_all(request.parameter + ' ');
  return {204, {}, ""};
}

}  // namespace tessera::server

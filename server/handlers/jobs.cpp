#include <charconv>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "proto/parse.h"
#include "server/config.h"
#include "server/handlers/handlers.h"
#include "server/handlers/own.h"
#include "server/http/query_errors.h"
#include "server/jobs/job_submission.h"
#include "server/jobs/job_table.h"
#include "server/store/blob_store.h"
#include "server/store/image_cache.h"

namespace tessera::server {

namespace {

constexpr std::size_t kDefaultListed = 100;
constexpr std::size_t kMostListed = 1000;
nlohmann::json status_json(const JobView& job) { return to_json(status_of(job, JobTimes::Clock::now())); }

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
  const OwnFiles files(services, request.who);
  auto parsed = proto::parse_job(request.body, files, services.config.documents, request.abandoned);
  if (!parsed) return problem_response(parsed.problem());
  const auto job = prepare_job(services, *std::move(parsed), request.who, request.abandoned);
  if (!job) return problem_response(job.problem());
  const auto id = start_job(services, *job);
  if (!id) return problem_response(id.problem());
  const auto view = services.jobs.find(*id);
  Response response = view ? json_response(201, status_json(*view)) : problem_response(view.problem());
  response.headers.emplace_back("Location", "/v1/jobs/" + *id);
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

  auto jobs =
      services.jobs.list(request.query("after").value_or(""), *limit + 1, state,
                         request.who.may(proto::Scope::admin) ? std::nullopt : std::optional(request.who.owner));
  nlohmann::json body{{"jobs", nlohmann::json::array()}};
  if (jobs.size() > *limit) {
    jobs.pop_back();
    body["next"] = jobs.back().id;
  }
  for (const JobView& job : jobs) body["jobs"].push_back(status_json(job));
  return json_response(200, body);
}

Response show_job(Services& services, Request& request) {
  const auto job = find_job(services, request);
  return job ? json_response(200, status_json(*job)) : problem_response(job.problem());
}

Response cancel_job(Services& services, Request& request) {
  if (const auto found = find_job(services, request); !found) return problem_response(found.problem());
  const auto job = services.jobs.cancel(request.parameter);
  return job ? json_response(202, status_json(*job)) : problem_response(job.problem());
}

Response delete_job(Services& services, Request& request) {
  if (const auto found = find_job(services, request); !found) return problem_response(found.problem());
  if (const auto problem = services.jobs.remove(request.parameter)) return problem_response(*problem);
  services.images.drop_all(request.parameter + ' ');
  return {204, {}, ""};
}

}  // namespace tessera::server

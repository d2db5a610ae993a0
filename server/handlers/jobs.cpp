#include <algorithm>
#include <charconv>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "proto/parse.h"
#include "proto/wire/sha256.h"
#include "server/config.h"
#include "server/handlers/handlers.h"
#include "server/handlers/own.h"
#include "server/handlers/preference.h"
#include "server/http/query_errors.h"
#include "server/jobs/job_submission.h"
#include "server/jobs/job_table.h"
#include "server/store/blob_store.h"
#include "server/store/held_files.h"
#include "server/store/image_cache.h"

namespace tessera::server {

namespace {

constexpr std::size_t kDefaultListed = 100;
constexpr std::size_t kMostListed = 1000;
std::string status_text(const JobView& job) { return json_text(status_of(job, JobTimes::Clock::now())); }

std::optional<std::size_t> read_limit(const Request& request) {
  const auto text = request.query("limit");
  if (!text) return kDefaultListed;
  std::size_t limit = 0;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), limit);
  if (error != std::errc() || end != text->data() + text->size() || limit < 1 || limit > kMostListed)
    return std::nullopt;
  return limit;
}

/// What the Idempotency-Key header says; nothing where there is none (draft-ietf-httpapi-idempotency-key-header).
proto::Result<std::optional<RetryKey>> read_retry_key(const Request& request) {
  constexpr std::size_t kLongest = 255;
  const auto header = request.header("idempotency-key");
  if (!header) return std::optional<RetryKey>();
  std::string_view key = *header;
  if (key.size() >= 2 && key.starts_with('"') && key.ends_with('"')) key = key.substr(1, key.size() - 2);
  const auto is_printable = [](char c) { return c >= ' ' && c <= '~'; };
  if (key.empty() || key.size() > kLongest || !std::ranges::all_of(key, is_printable))
    return proto::Problem{proto::ProblemCode::malformed_request,
                          "The header Idempotency-Key takes 1 to " + std::to_string(kLongest) +
                              " printable characters of ASCII, in quotes: a UUID, say.",
                          {}};
  return std::optional(RetryKey{request.who.owner + '\n' + std::string(key), proto::content_hash(request.body)});
}

/// A job's status as an answer.
struct Telling {
  int status;
  std::string job;
  std::optional<std::chrono::seconds> wait;  ///< The client prefers to wait so long for the job's end (RFC 7240).
  bool says_where;
};

Response tell(Services& services, const Telling& telling) {
  const auto job = services.jobs.find(telling.job);
  if (!job) return problem_response(job.problem());
  Response response = json_text_response(telling.status, status_text(*job));
  if (telling.says_where) response.headers.emplace_back("Location", "/v1/jobs/" + job->id);
  if (telling.wait)
    response.headers.emplace_back("Preference-Applied", "wait=" + std::to_string(telling.wait->count()));
  return response;
}

Response tell_in_time(Services& services, const Telling& telling) {
  const auto job = services.jobs.find(telling.job);
  if (!job || !telling.wait || proto::has_ended(job->state)) return tell(services, telling);
  const auto answer = [telling](Services& its_services, Request&) { return tell(its_services, telling); };
  Response response;
  response.later =
      std::make_shared<const Later>(Later{telling.job, JobTimes::Clock::now() + *telling.wait, nullptr, answer});
  return response;
}

/// To a request that was sent before, or so it says.
Response answer_retry(Services& services, const Request& request, const JobTable::Retry& retry) {
  using proto::ProblemCode;
  if (retry.is == JobTable::Retry::Is::in_progress)
    return problem_response(
        {ProblemCode::request_in_progress, "A request with this Idempotency-Key is still being answered.", {}});
  if (retry.is == JobTable::Retry::Is::another_request)
    return problem_response({ProblemCode::idempotency_key_reused,
                             "This Idempotency-Key came with another document before; give each job its own.",
                             {}});
  return tell_in_time(services, {200, retry.job, read_preference(request).wait, true});
}

}  // namespace

Response post_job(Services& services, Request& request) {
  const auto retry = read_retry_key(request);
  if (!retry) return problem_response(retry.problem());
  JobTable::Retry claim{JobTable::Retry::Is::first};
  if (*retry) claim = services.jobs.claim(**retry);
  if (claim.is != JobTable::Retry::Is::first) return answer_retry(services, request, claim);
  const OwnFiles own(services, request.who);
  const HeldFiles files(own);
  auto parsed = proto::parse_job(request.body, files, services.config.documents, request.abandoned);
  if (!parsed) return problem_response(parsed.problem());
  auto job = prepare_job(services, *std::move(parsed), request.body, request.who, request.abandoned);
  if (!job) return problem_response(job.problem());
  job->retry = *retry;
  if (const auto problem = keep_scene(services, *job, request.body, request.abandoned))
    return problem_response(*problem);
  const auto started = start_job(services, *job);
  if (!started) return problem_response(started.problem());
  const Telling telling{201, started->id, read_preference(request).wait, true};
  const auto answer = [telling, written = started->written](Services& its_services, Request&) {
    if (const auto& refused = written.get()) return problem_response(*refused);
    return tell_in_time(its_services, telling);
  };
  Response response;
  response.later =
      std::make_shared<const Later>(Later{started->id, std::nullopt, claim.claim, answer, /*until_written=*/true});
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
  const bool has_more = jobs.size() > *limit;
  if (has_more) jobs.pop_back();
  std::string text = R"({"jobs":[)";
  for (const JobView& job : jobs) (text += &job == &jobs.front() ? "" : ",") += status_text(job);
  text += ']';
  if (has_more) text += R"(,"next":")" + jobs.back().id + '"';
  Response response = json_text_response(200, std::move(text) + '}');
  if (has_more) {  // RFC 8288
    std::string next = "/v1/jobs?after=" + jobs.back().id;
    if (request.query("limit")) next += "&limit=" + std::to_string(*limit);
    if (state_name) next += "&state=" + std::string(*state_name);
    response.headers.emplace_back("Link", '<' + next + ">; rel=\"next\"");
  }
  return response;
}

Response show_job(Services& services, Request& request) {
  const auto job = find_job(services, request);
  if (!job) return problem_response(job.problem());
  const auto wait = read_preference(request).wait;
  if (!wait) return json_text_response(200, status_text(*job));
  return tell_in_time(services, {200, job->id, wait, false});
}

Response cancel_job(Services& services, Request& request) {
  if (const auto found = find_job(services, request); !found) return problem_response(found.problem());
  const auto job = services.jobs.cancel(request.parameter);
  return job ? json_text_response(202, status_text(*job)) : problem_response(job.problem());
}

Response delete_job(Services& services, Request& request) {
  if (const auto found = find_job(services, request); !found) return problem_response(found.problem());
  if (const auto problem = services.jobs.remove(request.parameter)) return problem_response(*problem);
  services.images.drop_all(request.parameter + ' ');
  return {204, {}, ""};
}

}  // namespace tessera::server

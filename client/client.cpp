#include "client/client.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <thread>

#include <nlohmann/json.hpp>

#include "client/failure.h"

namespace tessera::client {
namespace {

using nlohmann::json;

constexpr std::chrono::milliseconds kFirstPause{4}, kLongestPause{500};

bool is_success(unsigned status) { return status >= 200 && status < 300; }

std::string job_path(const std::string& id) { return "/v1/jobs/" + percent_encode(id); }

std::string text_of(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::vector<proto::FieldError> places(const json& document, const char* key) {
  std::vector<proto::FieldError> out;
  const auto list = document.find(key);
  if (list == document.end() || !list->is_array()) return out;
  for (const json& place : *list)
    if (place.is_object()) out.push_back({text_of(place, "pointer"), text_of(place, "detail")});
  return out;
}

/// What a refusal says: its problem document, or the bare status when whatever answered sends none.
Failure refusal(const HttpResponse& response) {
  std::string message = "HTTP status " + std::to_string(response.status);
  std::vector<proto::FieldError> errors;
  const json problem = json::parse(response.body, nullptr, false);
  if (problem.is_object()) {
    const std::string title = text_of(problem, "title");
    const std::string detail = text_of(problem, "detail");
    if (!title.empty()) message = title;
    if (!detail.empty()) message += ": " + detail;
    errors = places(problem, "errors");
  }
  if (!response.retry_after.empty()) message += " (try again in " + response.retry_after + " s)";
  return {Failure::Kind::refused, message, std::move(errors)};
}

/// For an answer that isn't what this program understands: another service, or a much newer one.
Failure not_understood(const std::string& what) {
  return {Failure::Kind::refused, "the server's answer is no " + what + "; is this a Tessera server?"};
}

json parse(const std::string& body, const std::string& what) {
  json parsed = json::parse(body, nullptr, false);
  if (parsed.is_discarded()) throw not_understood(what);
  return parsed;
}

proto::JobStatus status_of(const json& document) {
  auto status = proto::job_status(document);
  if (!status) throw not_understood("job status");
  return *std::move(status);
}

}  // namespace

std::string Client::call(HttpRequest request) const {
  HttpResponse response = exchange(address_, std::move(request));
  if (!is_success(response.status)) throw refusal(response);
  return std::move(response.body);
}

void Client::upload(const std::filesystem::path& file, const proto::ContentHash& hash) const {
  call({.method = "PUT", .target = "/v1/blobs/" + hash, .content_type = "application/octet-stream", .body = file});
}

proto::JobStatus Client::submit(const json& job) const {
  // A file's name, and so a job's, needn't be UTF-8.
  std::string text = job.dump(-1, ' ', false, json::error_handler_t::replace);
  return status_of(
      parse(call({.method = "POST", .target = "/v1/jobs", .content_type = "application/json", .body = std::move(text)}),
            "job status"));
}

std::vector<proto::FieldError> Client::warnings(const proto::ContentHash& scene) const {
  const json answer = parse(call({.method = "GET", .target = "/v1/scenes/" + scene}), "scene");
  return answer.is_object() ? places(answer, "warnings") : std::vector<proto::FieldError>();
}

proto::JobStatus Client::status(const std::string& id) const {
  return status_of(parse(call({.method = "GET", .target = job_path(id)}), "job status"));
}

proto::JobStatus Client::watch(const std::string& id, const std::function<void(const proto::JobStatus&)>& tell) const {
  const auto start = std::chrono::steady_clock::now();
  for (;;) {
    proto::JobStatus now = status(id);
    tell(now);
    if (proto::has_ended(now.state)) return now;
    // So the end is noticed within a twentieth of the job's time, with a few dozen questions for each tenfold of it.
    const auto pause = (std::chrono::steady_clock::now() - start) / 20;
    std::this_thread::sleep_for(std::clamp<std::chrono::nanoseconds>(pause, kFirstPause, kLongestPause));
  }
}

std::string Client::fetch(const std::string& id, const ImageRequest& image) const {
  std::string target = job_path(id) + "/image?format=" + percent_encode(image.format);
  if (!image.aov.empty()) target += "&aov=" + percent_encode(image.aov);
  if (image.partial) target += "&partial=1";
  return call({.method = "GET", .target = target});
}

std::vector<proto::JobStatus> Client::list() const {
  std::vector<proto::JobStatus> statuses;
  std::string after;
  do {
    const json page = parse(call({.method = "GET", .target = "/v1/jobs?limit=1000" + after}), "list of jobs");
    if (!page.is_object() || !page.value("jobs", json()).is_array()) throw not_understood("list of jobs");
    std::ranges::transform(page["jobs"], std::back_inserter(statuses), status_of);
    const std::string next = text_of(page, "next");
    after = next.empty() ? "" : "&after=" + percent_encode(next);
  } while (!after.empty());
  return statuses;
}

void Client::cancel(const std::string& id) const { call({.method = "POST", .target = job_path(id) + "/cancel"}); }

void Client::remove(const std::string& id) const { call({.method = "DELETE", .target = job_path(id)}); }

json Client::plan(const std::string& id) const {
  return parse(call({.method = "GET", .target = job_path(id) + "/plan"}), "plan");
}

json Client::stats(const std::string& id) const {
  return parse(call({.method = "GET", .target = job_path(id) + "/stats"}), "statistics");
}

json Client::capabilities() const {
  json answer = parse(call({.method = "GET", .target = "/v1/capabilities"}), "list of capabilities");
  if (!answer.is_object()) throw not_understood("list of capabilities");
  return answer;
}

}  // namespace tessera::client

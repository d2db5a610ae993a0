#include "client/client.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <thread>

#include <nlohmann/json.hpp>

#include "client/event_reader.h"
#include "client/failure.h"
#include "client/refusal.h"

namespace tessera::client {
namespace {

using nlohmann::json;

constexpr std::chrono::milliseconds kFirstPause{4}, kLongestPause{500};

bool is_success(unsigned status) { return status >= 200 && status < 300; }

std::string job_path(const std::string& id) { return "/v1/jobs/" + percent_encode(id); }

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
  request.key = key_;
  HttpResponse response = exchange(address_, std::move(request));
  if (!is_success(response.status)) throw refusal(response);
  return std::move(response.body);
}

void Client::upload(const std::filesystem::path& file, const proto::ContentHash& hash) const {
  try {
    call({.method = "PUT", .target = "/v1/blobs/" + hash, .content_type = "application/octet-stream", .body = file});
  } catch (const Failure& failure) {
    if (failure.kind() != Failure::Kind::refused) throw;
    throw Failure(failure.kind(), file.string() + ": " + failure.what(), failure.errors(), failure.code());
  }
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
  return field_errors(answer, "warnings");
}

proto::JobStatus Client::status(const std::string& id) const {
  return status_of(parse(call({.method = "GET", .target = job_path(id)}), "job status"));
}

std::optional<proto::JobStatus> Client::watch_events(const std::string& id,
                                                     const std::function<void(const proto::JobStatus&)>& tell) const {
  std::optional<proto::JobStatus> end;
  EventReader reader([&](std::string_view type, std::string_view text) {
    const json data = parse(std::string(text), "event");
    if (type == "progress") return tell(status_of(data));
    if (type != "state" || !data.is_object()) return;
    if (!data.contains("status")) return tell(status(id));
    end = status_of(data["status"]);
    tell(*end);
  });
  try {
    exchange(address_, {.method = "GET", .target = job_path(id) + "/events", .key = key_},
             [&](std::string_view piece) { reader.add(piece); });
  } catch (const Failure& failure) {
    if (failure.kind() != Failure::Kind::unreachable) throw;
  }
  return end;
}

proto::JobStatus Client::watch(const std::string& id, const std::function<void(const proto::JobStatus&)>& tell) const {
  if (auto end = watch_events(id, tell)) return *std::move(end);
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
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) target += '&' + (name + ('=' + percent_encode(value)));
  };
  add("aov", image.aov);
  add("partial", image.partial ? "1" : "");
  add("exposure", image.exposure);
  add("tone_map", image.tone_map);
  add("precision", image.precision);
  add("background", image.background);
  return call({.method = "GET", .target = target});
}

std::vector<proto::JobStatus> Client::list() const {
  std::vector<proto::JobStatus> statuses;
  std::string after;
  do {
    const json page = parse(call({.method = "GET", .target = "/v1/jobs?limit=1000" + after}), "list of jobs");
    if (!page.is_object() || !page.value("jobs", json()).is_array()) throw not_understood("list of jobs");
    std::ranges::transform(page["jobs"], std::back_inserter(statuses), status_of);
    const std::string next = page.value("next", "");
    after = next.empty() ? "" : "&after=" + percent_encode(next);
  } while (!after.empty());
  return statuses;
}

std::string Client::find_job(const std::string& written) const {
  if (written == "@latest") {
    const auto jobs = list();
    if (jobs.empty()) throw Failure(Failure::Kind::refused, "The server has no jobs", {}, "not_found");
    return jobs.back().id;
  }
  try {
    return status(written).id;
  } catch (const Failure& failure) {
    if (failure.code() != "not_found" || written.empty()) throw;
    std::vector<proto::FieldError> meant;
    for (const proto::JobStatus& job : list())
      if (job.id.starts_with(written)) meant.push_back({job.id, std::string(proto::name(job.state)) + ' ' + job.name});
    if (meant.empty()) throw;
    if (meant.size() == 1) return meant[0].pointer;
    throw Failure(Failure::Kind::usage, "'" + written + "' begins the ids of several jobs; give more of it",
                  std::move(meant));
  }
}

void Client::cancel(const std::string& id) const { call({.method = "POST", .target = job_path(id) + "/cancel"}); }

void Client::remove(const std::string& id) const { call({.method = "DELETE", .target = job_path(id)}); }

json Client::plan(const std::string& id) const {
  return parse(call({.method = "GET", .target = job_path(id) + "/plan"}), "plan");
}

json Client::stats(const std::string& id) const {
  return parse(call({.method = "GET", .target = job_path(id) + "/stats"}), "statistics");
}

HttpResponse Client::ask(const std::string& target) const {
  return exchange(address_, {.method = "GET", .target = target, .key = key_});
}

json Client::capabilities() const {
  json answer = parse(call({.method = "GET", .target = "/v1/capabilities"}), "list of capabilities");
  if (!answer.is_object()) throw not_understood("list of capabilities");
  return answer;
}

}  // namespace tessera::client

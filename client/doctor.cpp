#include "client/doctor.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <iterator>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>

#include "client/failure.h"
#include "proto/wire/certificate.h"
#include "proto/wire/key_file.h"

namespace tessera::client {
namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;
using Verdict = Finding::Verdict;

/// Between clocks that are kept right, a Date's whole seconds and the way included.
constexpr double kSkew = 5, kWrongClock = 300;
/// What rendering a small image may take on a server that has little else to do.
constexpr double kSlowRender = 5;
/// Who renews certificates by themselves has done so by then.
constexpr std::chrono::days kSoon{14};

double seconds_since(Clock::time_point then) { return std::chrono::duration<double>(Clock::now() - then).count(); }

std::string rounded(double value, const char* unit) {
  char text[48];
  std::snprintf(text, sizeof text, value < 10 ? "%.2f %s" : "%.0f %s", value, unit);
  return text;
}

std::string counted(double count, const char* unit) {
  char text[48];
  std::snprintf(text, sizeof text, "%.0f %s", count, unit);
  return text;
}

/// An answer's member as text, or nothing, whatever the answer is.
std::string text_of(const json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

double number_of(const json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found != object.end() && found->is_number() ? found->get<double>() : 0;
}

Finding clock_finding(const std::string& date) {
  const auto theirs = read_http_date(date);
  if (!theirs) return {Verdict::warn, "clock", "the server doesn't say what time it is", "ask who runs it"};
  const double skew = *theirs - static_cast<double>(std::time(nullptr));
  if (std::abs(skew) <= kSkew) return {Verdict::ok, "clock", "the server's agrees with this machine's"};
  const std::string detail =
      "the server's is " + rounded(std::abs(skew), "s") + (skew > 0 ? " ahead of" : " behind") + " this machine's";
  return {std::abs(skew) > kWrongClock ? Verdict::fail : Verdict::warn, "clock", detail,
          "have both machines' clocks kept by NTP (timedatectl)"};
}

/// Of a certificate that ends then.
Finding expiry_finding(const char* check, std::chrono::sys_seconds end, const std::string& what) {
  const auto left = end - std::chrono::system_clock::now();
  const std::string detail = what + " is valid until " + proto::to_text(end);
  const std::string advice = "renew it, and have the server read it: systemctl reload tesserad";
  if (left <= std::chrono::seconds(0)) return {Verdict::fail, check, detail + ", which has passed", advice};
  if (left < kSoon)
    return {Verdict::warn, check,
            detail + ": " + std::to_string(std::chrono::floor<std::chrono::days>(left).count()) + " days", advice};
  return {Verdict::ok, check, detail};
}

Finding version_finding(const json& answer, std::string_view ours) {
  const std::string theirs = text_of(answer, "version");
  if (theirs == ours) return {Verdict::ok, "version", theirs + ", as this program"};
  return {Verdict::warn, "version", "the server is " + theirs + ", this program " + std::string(ours),
          "install the same version on both"};
}

std::string figures_of(const std::string& check, const json& told) {
  if (check == "disk")
    return in_units(number_of(told, "free_bytes")) + " free; " + in_units(number_of(told, "least_free_bytes")) +
           " are the least";
  if (check == "memory")
    return "images of unfinished jobs take " + in_units(number_of(told, "unfinished_bytes")) + " of " +
           in_units(number_of(told, "limit_bytes"));
  if (check == "queue")
    return counted(number_of(told, "unfinished_jobs"), "jobs haven't ended; ") +
           counted(number_of(told, "limit_jobs"), "are the most");
  if (check == "isolation")
    return std::string("files are read in processes of their own, ") +
           (told.value("filters_system_calls", false) ? "whose system calls are filtered"
                                                      : "whose system calls the system can't filter");
  return "ready";
}

std::string advice_for(const std::string& check) {
  if (check == "disk") return "free space on the server's disk, or see to its --data-dir";
  if (check == "memory") return "wait for jobs to end, or raise --max-film-memory";
  if (check == "queue") return "wait for jobs to end, or raise --max-jobs";
  if (check == "isolation") return "start the server again";
  return "see the server's log";
}

std::string advice_for(Failure::Kind kind) {
  if (kind == Failure::Kind::unreachable) return "start tesserad, or say where it listens with --server";
  if (kind == Failure::Kind::untrusted) return "see to its --tls-certificate, or to --ca-file here";
  return "see the server's log";
}

void add_readiness(const HttpResponse& answer, std::vector<Finding>& to) {
  const json body = json::parse(answer.body, nullptr, false);
  const json checks = body.is_object() ? body.value("checks", json::object()) : json::object();
  if (!checks.is_object() || checks.empty()) {
    if (answer.status == 200) return to.push_back({Verdict::ok, "ready", "the server takes jobs"});
    return to.push_back({Verdict::fail, "ready", text_of(body, "detail"), "start it again, or wait until it is up"});
  }
  for (const auto& [name, told] : checks.items()) {
    const std::string problem = text_of(told, "problem");
    if (problem.empty())
      to.push_back({Verdict::ok, name, figures_of(name, told)});
    else
      to.push_back({Verdict::fail, name, problem, advice_for(name)});
  }
}

Finding descriptor_finding(const std::map<std::string, double>& metrics) {
  const auto figure = [&](const char* name) {
    const auto found = metrics.find(name);
    return found == metrics.end() ? 0.0 : found->second;
  };
  const double most = figure("process_max_fds"), open = figure("process_open_fds");
  const double connections = figure("tessera_http_connections_limit");
  if (most == 0)
    return {Verdict::warn, "descriptors", "the server doesn't tell its metrics", "ask with an admin's key"};
  const std::string detail = counted(open, "open") + " of " + counted(most, "file descriptors") + ", for at most " +
                             counted(connections, "connections");
  if (open > 0.9 * most)
    return {Verdict::fail, "descriptors", detail,
            "raise LimitNOFILE of its unit (ulimit -n), or lower --max-connections"};
  if (most < 2 * connections + 64)
    return {Verdict::warn, "descriptors", detail, "raise LimitNOFILE of its unit (ulimit -n)"};
  return {Verdict::ok, "descriptors", detail};
}

Finding render_finding(const Client& client) {
  const json job = {{"name", "tessera doctor"},
                    {"scene", {{"objects", {{{"type", "sphere"}, {"center", {0, 0, 0}}, {"radius", 1}}}}}},
                    {"image", {{"width", 16}, {"height", 16}}}};
  const Clock::time_point start = Clock::now();
  const std::string id = client.submit(job).id;
  const proto::JobStatus status = client.watch(id, [](const proto::JobStatus&) {});
  if (status.state != proto::JobState::completed)
    return {Verdict::fail, "render", "a small job is " + std::string(proto::name(status.state)) + ": " + status.error,
            "see the server's log"};
  const std::size_t bytes = client.fetch(id, {}).size();
  const double seconds = seconds_since(start);
  client.remove(id);
  const std::string detail = "16 × 16 pixels, " + std::to_string(bytes) + " bytes of PNG, in " +
                             rounded(seconds * 1e3, "ms") + " from submission to image";
  if (seconds <= kSlowRender) return {Verdict::ok, "render", detail};
  return {Verdict::warn, "render", detail, "see what keeps it busy: tessera list --state rendering"};
}

}  // namespace

std::string in_units(double bytes) {
  constexpr const char* kUnits[] = {"B", "KiB", "MiB", "GiB", "TiB", "PiB"};
  std::size_t unit = 0;
  for (; bytes >= 1024 && unit + 1 < std::size(kUnits); ++unit) bytes /= 1024;
  char text[48];
  std::snprintf(text, sizeof text, unit == 0 ? "%.0f %s" : "%.1f %s", bytes, kUnits[unit]);
  return text;
}

std::map<std::string, double> read_metrics(std::string_view text) {
  std::map<std::string, double> samples;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    const std::size_t blank = line.rfind(' ');
    if (line.starts_with('#') || blank == line.npos) continue;
    double value = 0;
    const auto [end, error] = std::from_chars(line.data() + blank + 1, line.data() + line.size(), value);
    if (error == std::errc() && end == line.data() + line.size()) samples.emplace(line.substr(0, blank), value);
  }
  return samples;
}

std::optional<double> read_http_date(const std::string& text) {
  std::tm parts{};
  const char* end = ::strptime(text.c_str(), "%a, %d %b %Y %H:%M:%S GMT", &parts);
  if (!end || *end != '\0') return std::nullopt;
  return static_cast<double>(::timegm(&parts));
}

std::vector<Finding> examine_server(const Client& client, std::string_view version) {
  std::vector<Finding> findings;
  const auto look = [&](const char* check, const std::function<void()>& at) {
    try {
      at();
    } catch (const Failure& failure) {
      std::string detail = failure.what();
      for (const proto::FieldError& error : failure.errors()) detail += "; " + error.pointer + ": " + error.detail;
      findings.push_back({Verdict::fail, check, detail, advice_for(failure.kind())});
    }
  };
  bool is_there = false;
  look("server", [&] {
    const Clock::time_point start = Clock::now();
    const HttpResponse answer = client.ask("/v1/version");
    const double seconds = seconds_since(start);
    const json told = json::parse(answer.body, nullptr, false);
    if (const std::string why = text_of(told, "detail"); !why.empty() && text_of(told, "name").empty())
      return findings.push_back({Verdict::fail, "server", why + " (status " + std::to_string(answer.status) + ')',
                                 answer.status == 401 ? "show a key that may read: --key-file FILE, or TESSERA_KEY"
                                                      : "say where it listens with --server"});
    if (text_of(told, "name") != "tessera")
      return findings.push_back(
          {Verdict::fail, "server",
           "what answers there is no Tessera server (status " + std::to_string(answer.status) + ')',
           "say where it listens with --server"});
    is_there = true;
    findings.push_back({Verdict::ok, "server", "answers in " + rounded(seconds * 1e3, "ms")});
    findings.push_back(version_finding(told, version));
    findings.push_back(clock_finding(answer.date));
    if (answer.certificate_expires)
      findings.push_back(expiry_finding("certificate", *answer.certificate_expires, "the one that the server shows"));
  });
  if (!is_there) return findings;
  look("ready", [&] { add_readiness(client.ask("/readyz"), findings); });
  look("descriptors", [&] { findings.push_back(descriptor_finding(read_metrics(client.ask("/metrics").body))); });
  look("render", [&] { findings.push_back(render_finding(client)); });
  return findings;
}

std::vector<Finding> examine_certificate(const std::filesystem::path& certificate, const std::filesystem::path& key,
                                         std::optional<std::chrono::sys_seconds> shown) {
  proto::Certificate files;
  try {
    files = proto::read_certificate(certificate, key);
  } catch (const std::runtime_error& error) {
    return {
        {Verdict::fail, "certificate files", error.what(), "mend the files: a server that runs keeps the old ones"}};
  }
  std::vector<Finding> findings{expiry_finding("certificate files", files.expires, certificate.string())};
  if (files.valid_from > std::chrono::system_clock::now())
    findings.front() = {Verdict::fail, "certificate files",
                        certificate.string() + " isn't valid before " + proto::to_text(files.valid_from),
                        "wait, or have the clock kept by NTP (timedatectl)"};
  // A chain ends when the first of it does, so that its end may come before that of the one that is shown.
  if (shown && *shown < files.expires)
    findings.push_back({Verdict::warn, "certificate in force", "the server shows one that ends before that of the file",
                        "have it read the file: systemctl reload tesserad"});
  if (files.others_can_read_key)
    findings.push_back({Verdict::warn, "certificate key", "every user of this machine can read " + key.string(),
                        "chmod o= " + key.string()});
  return findings;
}

}  // namespace tessera::client

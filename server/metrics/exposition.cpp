#include "server/metrics/exposition.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include "server/config.h"
#include "server/http/router.h"
#include "server/http/session.h"
#include "server/jobs/job_table.h"
#include "server/jobs/ledger.h"
#include "server/log.h"
#include "server/metrics/metrics.h"
#include "server/metrics/process_stats.h"
#include "server/store/image_cache.h"
#include "server/store/scene_store.h"
#include "server/store/set_aside.h"
#include "server/store/structure_cache.h"
#include "server/work/scheduler.h"

namespace tessera::server {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;
using Labels = std::vector<ClientMetric::Label>;

/// Collects families, each with all that it has.
class Families {
 public:
  /// What follows is of this family.
  void begin(std::string name, std::string help, MetricType type) {
    families_.push_back({std::move(name), std::move(help), type, {}});
  }
  template <typename Number>
  void add(Labels labels, Number value) {
    ClientMetric metric;
    metric.label = std::move(labels);
    if (families_.back().type == MetricType::Counter)
      metric.counter.value = static_cast<double>(value);
    else
      metric.gauge.value = static_cast<double>(value);
    families_.back().metric.push_back(std::move(metric));
  }
  void add(Labels labels, const Histogram& histogram) {
    const Histogram::Reading reading = histogram.read();
    ClientMetric metric;
    metric.label = std::move(labels);
    metric.histogram.sample_count = reading.count;
    metric.histogram.sample_sum = reading.sum;
    for (std::size_t i = 0; i < reading.bounds.size(); ++i)
      metric.histogram.bucket.push_back({reading.below[i], reading.bounds[i]});
    families_.back().metric.push_back(std::move(metric));
  }
  /// A family of one.
  template <typename Value>
  void one(std::string name, std::string help, MetricType type, const Value& value) {
    begin(std::move(name), std::move(help), type);
    add({}, value);
  }

  std::string text() const {
    std::ostringstream out;
    prometheus::TextSerializer().Serialize(out, families_);
    return std::move(out).str();
  }

 private:
  std::vector<MetricFamily> families_;
};

constexpr MetricType kCounter = MetricType::Counter, kGauge = MetricType::Gauge, kHistogram = MetricType::Histogram;

constexpr std::array kJobStates{proto::JobState::queued,    proto::JobState::preparing, proto::JobState::rendering,
                                proto::JobState::completed, proto::JobState::failed,    proto::JobState::canceled};

void tell_jobs(Families& to, const JobTable::Usage& usage) {
  to.begin("tessera_jobs", "Jobs that are known, by state.", kGauge);
  for (const proto::JobState state : kJobStates)
    to.add({{"state", std::string(proto::name(state))}}, usage.by_state[static_cast<std::size_t>(state)]);
  to.one("tessera_jobs_unfinished_limit", "Most jobs that may be unfinished.", kGauge, usage.limits.unfinished_jobs);
  to.begin("tessera_jobs_ended_total", "Jobs that have ended, by outcome.", kCounter);
  for (std::size_t i = 0; i < metrics().jobs_by_outcome.size(); ++i)
    to.add({{"outcome", std::string(proto::name(kJobStates[3 + i]))}}, metrics().jobs_by_outcome[i].load());
  to.one("tessera_job_queue_seconds", "How long jobs waited until work on them began.", kHistogram,
         metrics().queue_wait);
  to.one("tessera_job_seconds", "How long completed jobs took, from when they were accepted.", kHistogram,
         metrics().job_time);
  to.one("tessera_pass_seconds", "How long passes over an image took.", kHistogram, metrics().pass_time);
  to.one("tessera_tile_seconds", "How long a thread worked on a tile of a pass.", kHistogram, metrics().tile_time);
  to.begin("tessera_rays_total", "Rays by kind; skipped are those of the camera that can't hit anything.", kCounter);
  for (std::size_t i = 0; i < kRayKinds.size(); ++i)
    to.add({{"kind", kRayKinds[i].name}}, metrics().rays_by_kind[i].load());
}

void tell_webhooks(Families& to) {
  to.begin("tessera_webhook_attempts_total",
           "Tries to deliver a webhook, by what came of them: pending, it is tried again; failed, it isn't.", kCounter);
  for (const auto state : {proto::WebhookState::pending, proto::WebhookState::delivered, proto::WebhookState::failed})
    to.add({{"outcome", std::string(proto::name(state))}},
           metrics().webhook_attempts[static_cast<std::size_t>(state)].load());
  to.one("tessera_webhooks_pending", "Webhooks of jobs that have ended, and that are still to be delivered.", kGauge,
         metrics().webhooks_pending.load());
}

void tell_scheduler(Families& to, const Scheduler::Usage& usage) {
  to.one("tessera_scheduler_threads", "Threads that build and render, but for spare ones.", kGauge, usage.threads);
  to.one("tessera_scheduler_threads_busy", "Threads that are at work, spare ones included.", kGauge, usage.busy);
  to.begin("tessera_scheduler_core_seconds_total",
           "What threads did with their time: idle while there was no work at all, starved while others worked and "
           "nothing was left for them.",
           kCounter);
  to.add({{"state", "busy"}}, usage.busy_seconds);
  to.add({{"state", "starved"}}, usage.starved_seconds);
  to.add({{"state", "idle"}}, usage.idle_seconds);
}

void tell_storage(Families& to, const Services& services) {
  std::error_code lost;
  const auto space = std::filesystem::space(services.config.data_dir, lost);
  if (!lost)
    to.one("tessera_disk_free_bytes", "Of the data folder's disk, that the server may take.", kGauge, space.available);
  to.one("tessera_files_set_aside_total", "Files that were found damaged, and are in set-aside/.", kCounter,
         files_set_aside());
}

void tell_memory(Families& to, const Services& services, const JobTable::Usage& jobs,
                 const std::vector<std::pair<std::string, CacheUsage>>& caches) {
  to.begin("tessera_memory_bytes", "Memory that is accounted for, by what holds it.", kGauge);
  to.add({{"holder", "films_unfinished"}}, jobs.unfinished_bytes);
  to.add({{"holder", "films_ended"}}, jobs.ended_bytes);
  to.add({{"holder", "films_leaving"}}, jobs.leaving_bytes);
  to.add({{"holder", "passes"}}, jobs.passes_bytes);
  to.add({{"holder", "work"}}, services.ledger.booked());
  if (const Connections* connections = services.connections) {
    to.add({{"holder", "bodies"}}, connections->body_bytes.load());
    to.add({{"holder", "answers"}}, connections->answer_bytes.load());
  }
  for (const auto& [name, usage] : caches) to.add({{"holder", "cache_" + name}}, usage.bytes);
  to.one("tessera_memory_limit_bytes", "What --memory gives to all of that.", kGauge, services.config.memory);
  to.one("tessera_film_memory_limit_bytes", "Most memory for images of all jobs together.", kGauge,
         jobs.limits.film_bytes);

  to.begin("tessera_cache_bytes", "What a cache keeps.", kGauge);
  for (const auto& [name, usage] : caches) to.add({{"cache", name}}, usage.bytes);
  to.begin("tessera_cache_limit_bytes", "What a cache keeps at most.", kGauge);
  for (const auto& [name, usage] : caches) to.add({{"cache", name}}, usage.limit);
  to.begin("tessera_cache_requests_total",
           "What was asked of a cache: hit, it was there; joined, another one was having it made; miss, it was made.",
           kCounter);
  for (const auto& [name, usage] : caches) {
    to.add({{"cache", name}, {"result", "hit"}}, usage.hits);
    to.add({{"cache", name}, {"result", "joined"}}, usage.joined);
    to.add({{"cache", name}, {"result", "miss"}}, usage.misses);
  }
}

void tell_http(Families& to, const Services& services) {
  const Connections* const connections = services.connections;
  if (connections) {
    to.one("tessera_http_connections", "Connections that are open.", kGauge, connections->open.load());
    to.one("tessera_http_connections_limit", "Most connections at once.", kGauge, services.most_connections.load());
    to.one("tessera_http_requests_active", "Requests that have begun and aren't answered.", kGauge,
           connections->requests_active.load());
  }
  const auto rows = metrics().by_route();
  const auto labels = [&](std::size_t i) -> Labels {
    if (i + 1 == rows.size()) return {{"route", "none"}, {"method", "any"}};
    const Route& route = route_table()[i];
    return {{"route", std::string(route.pattern)}, {"method", std::string(route.method)}};
  };
  to.begin("tessera_http_requests_total",
           "Requests by route and status; 499: the client hung up before it was answered. HEAD counts as GET.",
           kCounter);
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (int status = RouteMetrics::kLeastStatus; status <= RouteMetrics::kMostStatus; ++status) {
      const std::uint64_t count = rows[i].by_status[static_cast<std::size_t>(status - RouteMetrics::kLeastStatus)];
      if (count == 0) continue;
      Labels with_status = labels(i);
      with_status.push_back({"code", std::to_string(status)});
      to.add(std::move(with_status), count);
    }
  to.begin("tessera_http_request_seconds", "From the end of a request's header to the end of its answer.", kHistogram);
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (rows[i].seconds.read().count > 0) to.add(labels(i), rows[i].seconds);
}

void tell_process(Families& to) {
  const ProcessStats stats = process_stats();
  to.one("process_cpu_seconds_total", "User and system time spent.", kCounter, stats.cpu_seconds);
  to.one("process_start_time_seconds", "When the process began, since 1970.", kGauge, stats.start_time);
  to.one("process_resident_memory_bytes", "Memory that is resident.", kGauge, stats.resident_bytes);
  to.one("process_virtual_memory_bytes", "Address space that is taken.", kGauge, stats.virtual_bytes);
  to.one("process_open_fds", "File descriptors that are open.", kGauge, stats.open_files);
  to.one("process_max_fds", "Most file descriptors.", kGauge, stats.most_files);
  to.one("process_threads", "Threads of the process.", kGauge, stats.threads);
  to.one("tessera_log_lines_dropped_total", "Lines of the log that nobody read in time.", kCounter,
         Log::lines_dropped());
  to.begin("tessera_build_info", "The program that runs; always 1.", kGauge);
  to.add({{"version", TESSERA_VERSION}, {"compiler", __VERSION__}}, 1);
}

}  // namespace

std::string exposition(Services& services) {
  const JobTable::Usage jobs = services.jobs.usage();
  Families families;
  tell_jobs(families, jobs);
  tell_webhooks(families);
  tell_scheduler(families, services.scheduler.usage());
  tell_storage(families, services);
  tell_memory(families, services, jobs,
              {{"scenes", services.scenes.scenes_usage()},
               {"documents", services.scenes.documents_usage()},
               {"structures", services.structures.usage()},
               {"images", services.images.usage()}});
  tell_http(families, services);
  tell_process(families);
  return families.text();
}

}  // namespace tessera::server

#include "server/metrics/metrics.h"

#include <algorithm>

#include "server/http/router.h"

namespace tessera::server {
namespace {

constexpr std::array kRequestSeconds{0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05,
                                     0.1,    0.2,    0.5,   1.0,   2.0,   5.0,  20.0, 60.0};
constexpr std::array kWorkSeconds{0.001, 0.003, 0.01, 0.03,  0.1,   0.3,    1.0,     3.0,
                                  10.0,  30.0,  60.0, 300.0, 900.0, 3600.0, 14400.0, 86400.0};
static_assert(kRequestSeconds.size() <= Histogram::kMostBounds && kWorkSeconds.size() <= Histogram::kMostBounds);

}  // namespace

RouteMetrics::RouteMetrics() : seconds(kRequestSeconds) {}

Metrics::Metrics()
    : queue_wait(kWorkSeconds),
      job_time(kWorkSeconds),
      pass_time(kWorkSeconds),
      tile_time(kWorkSeconds),
      routes_(route_table().size()),
      by_route_(std::make_unique<RouteMetrics[]>(routes_ + 1)) {}

void Metrics::job_ended(proto::JobState outcome, std::chrono::nanoseconds time) noexcept {
  const auto index = static_cast<std::size_t>(outcome) - static_cast<std::size_t>(proto::JobState::completed);
  jobs_by_outcome[index].fetch_add(1, std::memory_order_relaxed);
  if (outcome == proto::JobState::completed) job_time.add(time);
}

void Metrics::add_rays(const RayCounts& done, const RayCounts& before) noexcept {
  for (std::size_t i = 0; i < kRayKinds.size(); ++i)
    rays_by_kind[i].fetch_add(done.*kRayKinds[i].count - before.*kRayKinds[i].count, std::memory_order_relaxed);
}

void Metrics::request_answered(std::size_t route, int status, std::chrono::nanoseconds time) noexcept {
  RouteMetrics& row = by_route_[std::min(route, routes_)];
  const int counted = std::clamp(status, RouteMetrics::kLeastStatus, RouteMetrics::kMostStatus);
  row.by_status[static_cast<std::size_t>(counted - RouteMetrics::kLeastStatus)].fetch_add(1, std::memory_order_relaxed);
  row.seconds.add(time);
}

Metrics& metrics() {
  static Metrics of_this_process;
  return of_this_process;
}

}  // namespace tessera::server

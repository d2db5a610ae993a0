#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "core/integrator/ray_counts.h"
#include "proto/wire/job_status.h"
#include "server/metrics/histogram.h"

namespace tessera::server {

/// Requests of one route that have been answered.
struct RouteMetrics {
  RouteMetrics();

  /// Indexed by status − `kLeastStatus`.
  static constexpr int kLeastStatus = 100, kMostStatus = 599;
  std::array<std::atomic<std::uint64_t>, kMostStatus - kLeastStatus + 1> by_status{};
  Histogram seconds;  ///< From the end of a header to the end of the answer.
};

/// Rays as metrics tell them apart: kinds that are traced, and those of the camera that needn't be.
struct RayKind {
  const char* name;
  std::uint64_t RayCounts::*count;
};
inline constexpr std::array kRayKinds{
    RayKind{"camera", &RayCounts::camera},         RayKind{"reflection", &RayCounts::reflection},
    RayKind{"refraction", &RayCounts::refraction}, RayKind{"shadow", &RayCounts::shadow},
    RayKind{"scattered", &RayCounts::scattered},   RayKind{"skipped", &RayCounts::camera_skipped}};

/// What has been counted since the process began, for `GET /metrics`: there is one, as there is one log. Everything in
/// it is safe to add to and to read from any number of threads, and nothing in it locks. What is there at the moment,
/// memory and jobs by state say, isn't counted here: its owners are asked (`exposition`).
class Metrics {
 public:
  Metrics();

  /// A job ended in `outcome`, so long after it came.
  void job_ended(proto::JobState outcome, std::chrono::nanoseconds time) noexcept;

  /// More rays than were told `before`.
  void add_rays(const RayCounts& done, const RayCounts& before) noexcept;

  /// A request has been answered. `route` is its place in the table of routes, or any larger number for one that fits
  /// none; `status` is one of HTTP's, or 499 where the client had hung up.
  void request_answered(std::size_t route, int status, std::chrono::nanoseconds time) noexcept;

  Histogram queue_wait;                                         ///< Of jobs, until work on them begins.
  Histogram job_time;                                           ///< Of completed ones, from when they came.
  Histogram pass_time, tile_time;                               ///< Of a tile, what it was worked on in a pass.
  std::array<std::atomic<std::uint64_t>, 3> jobs_by_outcome{};  ///< From `JobState::completed` on.
  std::array<std::atomic<std::uint64_t>, kRayKinds.size()> rays_by_kind{};
  std::array<std::atomic<std::uint64_t>, 3> webhook_attempts{};  ///< By what came of them, a `WebhookState`.
  std::atomic<std::uint64_t> webhooks_pending{0};                ///< Of jobs that have ended.

  /// A row for each route, and one for requests that fit none.
  std::span<const RouteMetrics> by_route() const { return {by_route_.get(), routes_ + 1}; }

 private:
  const std::size_t routes_;
  const std::unique_ptr<RouteMetrics[]> by_route_;
};

/// The one of this process.
Metrics& metrics();

}  // namespace tessera::server

#include <algorithm>
#include <chrono>
#include <optional>

#include <nlohmann/json.hpp>

#include "core/accel/accel_table.h"
#include "server/handlers/handlers.h"
#include "server/job_runner.h"
#include "server/job_table.h"

namespace tessera::server {
namespace {

using nlohmann::json;
using Clock = JobTimes::Clock;

/// Whether a structure is built for the job: not without rays to trace, nor of a kind that just tests everything.
bool is_built(const PlanReport& plan) {
  const auto row = std::ranges::find(accel_table(), plan.accel.kind, &AccelEntry::kind);
  return plan.needs_structure && row->builds;
}

json plan_json(const JobView& job) {
  const PlanReport& plan = *job.plan;
  const Settings& settings = job.order->settings;
  json skips = json::array();
  for (const Skip& skip : plan.skips)
    skips.push_back({{"what", skip.what}, {"because", skip.because}, {"count", skip.count}});
  return {
      {"ready", true},
      {"image", {{"width", settings.width}, {"height", settings.height}, {"samples", settings.samples}}},
      {"accel", {{"kind", accel_name(plan.accel.kind)}, {"because", plan.accel_because}, {"is_built", is_built(plan)}}},
      {"tiles",
       {{"count", plan.tiles},
        {"empty", plan.tiles_empty},
        {"with_candidates", plan.tiles_with_candidates},
        {"smallest_pixels", plan.smallest_tile},
        {"largest_pixels", plan.largest_tile}}},
      {"objects", plan.objects},
      {"objects_on_screen", plan.objects_on_screen},
      {"primitives", plan.primitives},
      {"camera_rays", plan.camera_rays},
      {"skips", std::move(skips)},
  };
}

json structure_json(const std::optional<StructureUse>& use) {
  if (!use) return nullptr;
  return {{"kind", accel_name(use->options.kind)}, {"build_seconds", use->build_seconds}, {"bytes", use->stats.bytes},
          {"nodes", use->stats.nodes},     {"leaves", use->stats.leaves},         {"depth", use->stats.depth},
          {"shared", use->shared}};
}

double seconds(Clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

/// How long a state lasted, or has lasted by now; nothing when it wasn't reached.
std::optional<double> lasted(std::optional<Clock::time_point> from, std::optional<Clock::time_point> next,
                             Clock::time_point last) {
  if (!from) return std::nullopt;
  return seconds(next.value_or(last) - *from);
}

json or_null(std::optional<double> value) { return value ? json(*value) : json(nullptr); }

json stats_json(const JobView& job, unsigned threads) {
  const RayCounts rays = job.progress->rays();
  const JobTimes& times = job.times;
  const Clock::time_point last = times.ended.value_or(Clock::now());
  const auto rendering = lasted(times.rendering, std::nullopt, last);
  std::optional<double> mrays_per_second;
  if (rays.traced() > 0 && rendering && *rendering > 0)
    mrays_per_second = static_cast<double>(rays.traced()) / *rendering * 1e-6;
  return {
      {"state", proto::name(job.state)},
      {"structure", structure_json(job.structure)},
      {"rays",
       {{"camera", rays.camera},
        {"camera_hits", rays.camera_hits},
        {"reflection", rays.reflection},
        {"refraction", rays.refraction},
        {"shadow", rays.shadow},
        {"total", rays.traced()}}},
      {"skipped",
       {{"tiles", job.plan ? job.plan->tiles_empty : 0},
        {"camera_rays", rays.camera_skipped},
        {"objects_never_tested", job.tested ? job.tested->unmarked() : 0}}},
      {"timing",
       {{"queued", or_null(lasted(times.queued, times.preparing, last))},
        {"preparing", or_null(lasted(times.preparing, times.rendering, last))},
        {"rendering", or_null(rendering)},
        {"total", seconds(last - times.queued)}}},
      {"mrays_per_second", or_null(mrays_per_second)},
      {"threads", threads},
  };
}

}  // namespace

Response show_plan(Services& services, Request& request) {
  const auto job = services.jobs.find(request.parameter);
  if (!job) return problem_response(job.problem());
  return json_response(200, job->plan ? plan_json(*job) : json{{"ready", false}});
}

Response show_stats(Services& services, Request& request) {
  const auto job = services.jobs.find(request.parameter);
  return job ? json_response(200, stats_json(*job, services.runner.threads())) : problem_response(job.problem());
}

}  // namespace tessera::server

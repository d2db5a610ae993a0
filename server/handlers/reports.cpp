#include <chrono>
#include <optional>

#include <nlohmann/json.hpp>

#include "core/accel/accel_table.h"
#include "core/render/render.h"
#include "server/handlers/accel_json.h"
#include "server/handlers/handlers.h"
#include "server/handlers/own.h"
#include "server/jobs/job_runner.h"
#include "server/jobs/job_table.h"

namespace tessera::server {
namespace {

using nlohmann::json;
using Clock = JobTimes::Clock;

/// Whether a structure is built for the job: not without rays to trace, nor of a kind that just tests everything.
bool is_built(const PlanReport& plan) {
  const AccelEntry* row = accel_entry(plan.accel.kind);
  return plan.needs_structure && row && row->builds;
}

json candidates_json(const PlanReport& plan) {
  json list = json::array();
  for (const AccelEstimate& estimate : plan.candidates)
    list.push_back({{"kind", accel_name(estimate.options.kind)},
                    {"options", accel_options_json(estimate.options)},
                    {"build_seconds", estimate.build_seconds},
                    {"trace_seconds", estimate.trace_seconds},
                    {"total_seconds", estimate.build_seconds + estimate.trace_seconds}});
  return list;
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
      {"accel",
       {{"kind", accel_name(plan.accel.kind)},
        {"options", accel_options_json(plan.accel)},
        {"because", plan.accel_because},
        {"is_built", is_built(plan)}}},
      {"candidates", candidates_json(plan)},
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
  return {{"kind", accel_name(use->options.kind)},
          {"options", accel_options_json(use->options)},
          {"build_seconds", use->build_seconds},
          {"bytes", use->stats.bytes},
          {"nodes", use->stats.nodes},
          {"leaves", use->stats.leaves},
          {"depth", use->stats.depth},
          {"meshes", use->stats.meshes},
          {"meshes_built", use->stats.meshes_ready - use->stats.meshes_loaded},
          {"meshes_loaded", use->stats.meshes_loaded},
          {"shared", use->shared}};
}

/// Meshes that no ray has come to; nothing as long as there may be more rays.
json meshes_never_built(const JobView& job) {
  if (job.state != proto::JobState::completed || !job.structure) return nullptr;
  return job.structure->stats.meshes - job.structure->stats.meshes_ready;
}

/// `part` by `whole`; nothing where there is no whole.
json ratio(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? json(nullptr) : json(static_cast<double>(part) / static_cast<double>(whole));
}

json tests_json(const JobView& job, std::uint64_t rays) {
  if (!counts_tests(job.order->settings)) return nullptr;
  const TestCounts tests = job.progress->tests();
  return {{"rays", rays},
          {"volume_tests", tests.volume_tests},
          {"volume_hits", tests.volume_hits},
          {"object_tests", tests.object_tests},
          {"object_hits", tests.object_hits},
          {"false_hits", tests.false_hits},
          {"per_ray",
           {{"volume_tests", ratio(tests.volume_tests, rays)}, {"object_tests", ratio(tests.object_tests, rays)}}},
          {"false_hit_rate", ratio(tests.false_hits, tests.volume_hits)}};
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
  const CoreSeconds cores = job.progress->core_seconds();
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
        {"scattered", rays.scattered},
        {"total", rays.traced()}}},
      {"tests", tests_json(job, rays.traced())},
      {"skipped",
       {{"tiles", job.plan ? job.plan->tiles_empty : 0},
        {"camera_rays", rays.camera_skipped},
        {"objects_never_tested", job.tested ? job.tested->unmarked() : job.never_tested},
        {"meshes_never_built", meshes_never_built(job)}}},
      {"timing",
       {{"queued", or_null(lasted(times.queued, times.preparing, last))},
        {"preparing", or_null(lasted(times.preparing, times.rendering, last))},
        {"rendering", or_null(rendering)},
        {"total", seconds(last - times.queued)}}},
      {"core_seconds", {{"busy", cores.busy}, {"idle", cores.idle}}},
      {"mrays_per_second", or_null(mrays_per_second)},
      {"threads", threads},
  };
}

}  // namespace

Response show_plan(Services& services, Request& request) {
  const auto job = find_job(services, request);
  if (!job) return problem_response(job.problem());
  return json_response(200, job->plan ? plan_json(*job) : json{{"ready", false}});
}

Response show_stats(Services& services, Request& request) {
  const auto job = find_job(services, request);
  return job ? json_response(200, stats_json(*job, services.runner.threads())) : problem_response(job.problem());
}

}  // namespace tessera::server

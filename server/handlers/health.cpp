#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "proto/import/import.h"
#include "proto/names.h"
#include "server/config.h"
#include "server/handlers/accel_json.h"
#include "server/handlers/documents.h"
#include "server/handlers/handlers.h"
#include "server/handlers/image_choice.h"
#include "server/isolation/confinement.h"
#include "server/isolation/isolation.h"
#include "server/jobs/job_runner.h"
#include "server/jobs/job_starter.h"
#include "server/jobs/job_table.h"
#include "server/jobs/ledger.h"
#include "server/log.h"
#include "server/store/disk_health.h"
#include "server/store/journal.h"

namespace tessera::server {
namespace {

using nlohmann::json;

Response document(std::string_view text, std::string_view media_type) {
  return {200, {{"Content-Type", std::string(media_type)}}, std::string(text)};
}

json formats_json() {
  json list = json::array();
  for (const FormatEntry& entry : format_table())
    list.push_back({{"format", entry.name},
                    {"media_type", entry.media_type},
                    {"max_width", limits_of(entry.format).max_width},
                    {"max_height", limits_of(entry.format).max_height}});
  return list;
}

template <typename T>
json names_json(std::span<const proto::Choice<T>> choices) {
  json list = json::array();
  for (const proto::Choice<T>& choice : choices) list.push_back(choice.name);
  return list;
}

/// Something that has to be well for a job to be taken.
struct ReadinessCheck {
  const char* name;
  std::string problem;  ///< Empty where it is well.
  json figures;
};

std::vector<ReadinessCheck> readiness_checks(Services& services) {
  const std::uint64_t least_free = services.least_free_disk;
  DiskHealth disk = disk_health(services.config.data_dir, least_free);
  if (const auto trouble = services.journal.trouble(); trouble && disk.problem.empty())
    disk.problem = "the journal can't be written: " + trouble->detail;
  const JobTable::Usage jobs = services.jobs.usage();
  // While there is room for a job the server is ready, however much it has to do; when there is none it isn't, for
  // whoever sends jobs here would only be refused.
  const auto refusal = services.jobs.refusal(Settings{});
  const auto why = [&](proto::ProblemCode code) { return refusal && refusal->code == code ? refusal->detail : ""; };
  std::string memory = why(proto::ProblemCode::out_of_memory_budget), queue = why(proto::ProblemCode::too_many_jobs);
  return {{"disk", std::move(disk.problem), {{"free_bytes", disk.free_bytes}, {"least_free_bytes", least_free}}},
          {"memory",
           std::move(memory),
           {{"unfinished_bytes", jobs.unfinished_bytes + jobs.passes_bytes},
            {"limit_bytes", jobs.limits.film_bytes},
            {"work_bytes", services.ledger.booked()},
            {"work_limit_bytes", services.ledger.limit()}}},
          {"queue",
           std::move(queue),
           {{"unfinished_jobs", jobs.unfinished},
            {"waiting_for_memory", services.starter.waiting()},
            {"limit_jobs", jobs.limits.unfinished_jobs}}},
          {"isolation", services.isolation.problem(), {{"filters_system_calls", can_filter_system_calls()}}}};
}

}  // namespace

Response livez(Services&, Request&) {
  return json_response(200, {{"status", "alive"}, {"log_lines_dropped", Log::lines_dropped()}});
}

Response readyz(Services& services, Request&) {
  if (services.draining)
    return problem_response({proto::ProblemCode::shutting_down, "The server is about to stop.", {}});
  std::string not_ready;
  json checks = json::object();
  for (ReadinessCheck& check : readiness_checks(services)) {
    json& told = checks[check.name] = std::move(check.figures);
    told["ready"] = check.problem.empty();
    if (check.problem.empty()) continue;
    not_ready += (not_ready.empty() ? "" : "; ") + std::string(check.name) + ": " + check.problem;
    told["problem"] = std::move(check.problem);
  }
  if (not_ready.empty()) return json_response(200, {{"status", "ready"}, {"checks", std::move(checks)}});
  return problem_response({proto::ProblemCode::not_ready, not_ready + '.', {}}, {{"checks", std::move(checks)}});
}

Response show_version(Services&, Request&) {
  return json_response(200, {{"name", "tessera"}, {"version", TESSERA_VERSION}, {"api", "v1"}});
}

Response show_capabilities(Services& services, Request&) {
  const Config& config = services.config;
  const JobTable::Limits limits = services.jobs.usage().limits;
  return json_response(200, {{"accel", accel_capabilities_json()},
                             {"screen_bounds", names_json(proto::screen_bounds_names())},
                             {"aovs", names_json(proto::aov_names())},
                             {"integrators", names_json(proto::integrator_names())},
                             {"samplers", names_json(proto::sampler_names())},
                             {"filters", names_json(proto::filter_names())},
                             {"image_formats", formats_json()},
                             {"tone_maps", names_json(tone_map_names())},
                             {"file_formats", names_json(proto::file_format_names())},
                             {"asset_root", config.asset_root.has_value()},
                             {"threads", services.runner.threads()},
                             {"limits",
                              {{"connections", services.most_connections.load()},
                               {"document_bytes", config.max_body},
                               {"blob_bytes", config.max_blob},
                               {"unfinished_jobs", limits.unfinished_jobs},
                               {"ended_jobs", limits.ended_jobs},
                               {"film_bytes", limits.film_bytes},
                               {"pixels", config.documents.max_pixels},
                               {"tiles", config.documents.max_tiles},
                               {"samples", config.documents.max_samples},
                               {"primitives", config.documents.max_primitives},
                               {"objects", config.documents.max_objects},
                               {"scene_bytes", config.documents.max_scene_bytes},
                               {"nesting", config.documents.max_depth}}}});
}

Response show_openapi(Services&, Request&) { return document(kOpenApiDocument, "application/json"); }
Response list_schemas(Services&, Request&) {
  return json_response(200, {{"schemas", {"/schemas/scene.schema.json", "/schemas/job.schema.json"}}});
}
Response show_scene_schema(Services&, Request&) { return document(kSceneSchema, "application/schema+json"); }
Response show_job_schema(Services&, Request&) { return document(kJobSchema, "application/schema+json"); }

}  // namespace tessera::server

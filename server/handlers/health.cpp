#include <string>

#include <nlohmann/json.hpp>

#include "proto/import/import.h"
#include "proto/names.h"
#include "server/config.h"
#include "server/handlers/accel_json.h"
#include "server/handlers/documents.h"
#include "server/handlers/handlers.h"
#include "server/handlers/image_choice.h"
#include "server/jobs/job_runner.h"
#include "server/jobs/job_table.h"
#include "server/log.h"

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

}  // namespace

Response livez(Services&, Request&) {
  return json_response(200, {{"status", "alive"}, {"log_lines_dropped", Log::lines_dropped()}});
}

Response readyz(Services& services, Request&) {
  if (services.shutting_down)
    return problem_response({proto::ProblemCode::shutting_down, "The server is about to stop.", {}});
  // While there is room for a job the server is ready, however much it has to do; when there is none it isn't, for
  // whoever sends jobs here would only be refused.
  if (const auto refusal = services.jobs.refusal(Settings{}))
    return problem_response({proto::ProblemCode::not_ready, refusal->detail, {}});
  return json_response(200, {{"status", "ready"}});
}

Response show_version(Services&, Request&) {
  return json_response(200, {{"name", "tessera"}, {"version", TESSERA_VERSION}, {"api", "v1"}});
}

Response show_capabilities(Services& services, Request&) {
  const Config& config = services.config;
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
                              {{"connections", config.max_connections},
                               {"document_bytes", config.max_body},
                               {"blob_bytes", config.max_blob},
                               {"unfinished_jobs", config.max_jobs},
                               {"ended_jobs", config.max_ended_jobs},
                               {"film_bytes", config.max_film_memory},
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

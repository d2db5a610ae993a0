#include <string>

#include <nlohmann/json.hpp>

#include "core/accel/accel_table.h"
#include "server/config.h"
#include "server/documents.h"
#include "server/handlers/handlers.h"
#include "server/image_choice.h"
#include "server/job_runner.h"

namespace tessera::server {
namespace {

using nlohmann::json;

Response document(std::string_view text, std::string_view media_type) {
  return {200, {{"Content-Type", std::string(media_type)}}, std::string(text)};
}

json accel_json() {
  json list = json::array();
  list.push_back({{"kind", accel_name(AccelKind::automatic)}, {"summary", "the plan picks one of the others"}});
  for (const AccelEntry& entry : accel_table()) list.push_back({{"kind", entry.name}, {"summary", entry.summary}});
  return list;
}

json formats_json() {
  json list = json::array();
  for (const FormatEntry& entry : format_table())
    list.push_back({{"format", entry.name}, {"media_type", entry.media_type}});
  return list;
}

json aovs_json() {
  json list = json::array();
  for (const PlaneEntry& entry : plane_table())
    if (entry.plane != Plane::color && entry.plane != Plane::all) list.push_back(entry.name);
  return list;
}

}  // namespace

Response livez(Services&, Request&) { return json_response(200, {{"status", "alive"}}); }

Response readyz(Services& services, Request&) {
  if (services.shutting_down)
    return problem_response({proto::ProblemCode::shutting_down, "The server is about to stop.", {}});
  return json_response(200, {{"status", "ready"}});
}

Response show_version(Services&, Request&) {
  return json_response(200, {{"name", "tessera"}, {"version", TESSERA_VERSION}, {"api", "v1"}});
}

Response show_capabilities(Services& services, Request&) {
  const Config& config = services.config;
  return json_response(200, {{"accel", accel_json()},
                             {"screen_bounds", {"off", "flat"}},
                             {"aovs", aovs_json()},
                             {"image_formats", formats_json()},
                             {"file_formats", {"obj", "ply", "nff"}},
                             {"asset_root", config.asset_root.has_value()},
                             {"threads", services.runner.threads()},
                             {"limits",
                              {{"document_bytes", config.max_body},
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
Response show_scene_schema(Services&, Request&) { return document(kSceneSchema, "application/schema+json"); }
Response show_job_schema(Services&, Request&) { return document(kJobSchema, "application/schema+json"); }

}  // namespace tessera::server

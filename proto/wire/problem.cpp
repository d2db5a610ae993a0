#include "proto/wire/problem.h"

#include <array>

#include <nlohmann/json.hpp>

namespace tessera::proto {
namespace {

// In the order of the enumeration: `entry` looks rows up by index, and a test holds the two together.
constexpr std::array kTable{
    ProblemEntry{ProblemCode::malformed_json, "malformed_json", 400, "The body is not well-formed JSON"},
    ProblemEntry{ProblemCode::malformed_request, "malformed_request", 400, "The request is malformed"},
    ProblemEntry{ProblemCode::not_found, "not_found", 404, "There is no such resource"},
    ProblemEntry{ProblemCode::method_not_allowed, "method_not_allowed", 405, "The resource has no such method"},
    ProblemEntry{ProblemCode::not_acceptable, "not_acceptable", 406, "No acceptable representation"},
    ProblemEntry{ProblemCode::image_not_ready, "image_not_ready", 409, "The image is not ready"},
    ProblemEntry{ProblemCode::job_still_active, "job_still_active", 409, "The job has not ended"},
    ProblemEntry{ProblemCode::job_already_ended, "job_already_ended", 409, "The job has already ended"},
    ProblemEntry{ProblemCode::image_gone, "image_gone", 410, "The image is gone"},
    ProblemEntry{ProblemCode::payload_too_large, "payload_too_large", 413, "The body is too large"},
    ProblemEntry{ProblemCode::unsupported_media_type, "unsupported_media_type", 415,
                 "The body's media type is not supported"},
    ProblemEntry{ProblemCode::invalid_document, "invalid_document", 422, "The document is not valid"},
    ProblemEntry{ProblemCode::hash_mismatch, "hash_mismatch", 422, "The content does not have the stated hash"},
    ProblemEntry{ProblemCode::too_many_jobs, "too_many_jobs", 429, "Too many jobs are waiting"},
    ProblemEntry{ProblemCode::out_of_memory_budget, "out_of_memory_budget", 503, "The server is short of memory"},
    ProblemEntry{ProblemCode::not_ready, "not_ready", 503, "The server takes no jobs now"},
    ProblemEntry{ProblemCode::shutting_down, "shutting_down", 503, "The server is shutting down"},
    ProblemEntry{ProblemCode::internal_error, "internal_error", 500, "The server made a mistake"},
};

}  // namespace

std::span<const ProblemEntry> problem_table() { return kTable; }

const ProblemEntry& entry(ProblemCode code) { return kTable.at(static_cast<std::size_t>(code)); }

nlohmann::json to_json(const Problem& problem) {
  const ProblemEntry& row = entry(problem.code);
  nlohmann::json json{{"type", "/problems/" + std::string(row.name)},
                      {"title", row.title},
                      {"status", row.status},
                      {"detail", problem.detail},
                      {"code", row.name}};
  nlohmann::json& errors = json["errors"] = nlohmann::json::array();
  for (const FieldError& error : problem.errors)
    errors.push_back({{"pointer", error.pointer}, {"detail", error.detail}});
  return json;
}

}  // namespace tessera::proto

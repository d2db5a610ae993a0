#include "server/http/router.h"

#include <algorithm>
#include <exception>
#include <iterator>
#include <new>
#include <optional>

#include <spdlog/spdlog.h>

#include "proto/wire/abandoned.h"
#include "proto/wire/sha256.h"
#include "server/config.h"
#include "server/handlers/drake_form.h"
#include "server/handlers/handlers.h"
#include "server/handlers/job_draft.h"
#include "server/http/media_type.h"
#include "server/http/query_errors.h"
#include "server/store/storage_error.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

namespace {

Route open_to_all(Route route) {
  route.needs.reset();
  return route;
}

}  // namespace

std::span<const Route> route_table() {
  static const std::vector<Route> table = {
      {"PUT", "/v1/blobs/{hash}", {}, Body::file, Place::slow, put_blob},
      {"DELETE", "/v1/blobs/{hash}", {}, Body::none, Place::quick, delete_blob},
      {"POST", "/v1/scenes", {}, Body::json, Place::quick, post_scene},
      {"GET", "/v1/scenes/{hash}", {}, Body::none, Place::quick, describe_scene},
      {"DELETE", "/v1/scenes/{hash}", {}, Body::none, Place::quick, delete_scene},
      {"POST", "/v1/jobs", {}, Body::json, Place::quick, post_job},
      {"GET", "/v1/jobs", {"after", "limit", "state"}, Body::none, Place::io, list_jobs},
      {"GET", "/v1/jobs/{id}", {}, Body::none, Place::io, show_job},
      {"DELETE", "/v1/jobs/{id}", {}, Body::none, Place::quick, delete_job},
      {"POST", "/v1/jobs/{id}/cancel", {}, Body::none, Place::quick, cancel_job},
      {"GET",
       "/v1/jobs/{id}/image",
       {"aov", "format", "partial", "quality", "subsampling", "exposure", "tone_map", "background", "precision"},
       Body::none,
       Place::quick,
       fetch_image},
      {"GET", "/v1/jobs/{id}/plan", {}, Body::none, Place::io, show_plan},
      {"GET", "/v1/jobs/{id}/stats", {}, Body::none, Place::io, show_stats},
      {"GET", "/v1/jobs/{id}/events", {}, Body::none, Place::io, watch_job},
      {"GET", "/v1/events", {}, Body::none, Place::io, watch_jobs},
      {"POST", "/v1/render", render_query_names(), Body::asset, Place::quick, post_render},
      {"POST", "/render", drake_query_names(), Body::asset, Place::quick, post_drake_render, text_response, true},
      open_to_all({"GET", "/livez", {}, Body::none, Place::io, livez}),
      open_to_all({"GET", "/readyz", {}, Body::none, Place::quick, readyz}),
      {"GET", "/metrics", {}, Body::none, Place::quick, show_metrics},
      {"GET", "/v1/version", {}, Body::none, Place::io, show_version},
      {"GET", "/v1/capabilities", {}, Body::none, Place::io, show_capabilities},
      open_to_all({"GET", "/openapi.json", {}, Body::none, Place::io, show_openapi}),
      open_to_all({"GET", "/schemas/", {}, Body::none, Place::io, list_schemas}),
      open_to_all({"GET", "/schemas/scene.schema.json", {}, Body::none, Place::io, show_scene_schema}),
      open_to_all({"GET", "/schemas/job.schema.json", {}, Body::none, Place::io, show_job_schema}),
      open_to_all({"GET", "/problems/", {}, Body::none, Place::io, list_problems}),
      open_to_all({"GET", "/problems/{code}", {}, Body::none, Place::io, show_problem}),
  };
  return table;
}

namespace {

/// The segment at the pattern's {…} (empty if it has none) when the path fits.
std::optional<std::string> match(std::string_view pattern, const std::vector<std::string>& segments) {
  std::string parameter;
  for (const std::string& segment : segments) {
    if (!pattern.starts_with('/')) return std::nullopt;
    pattern.remove_prefix(1);
    const std::string_view wanted = pattern.substr(0, pattern.find('/'));
    pattern.remove_prefix(wanted.size());
    if (!wanted.starts_with('{')) {
      if (segment != wanted) return std::nullopt;
      continue;
    }
    parameter = segment;
  }
  if (!pattern.empty()) return std::nullopt;
  return parameter;
}

std::string listed(const std::vector<std::string_view>& names) {
  std::string text;
  for (const std::string_view name : names) text += (text.empty() ? "" : ", ") + std::string(name);
  return text;
}

/// A hash that can't be one names nothing; for a file that is sent under it, it is the sender's mistake.
std::optional<Problem> refuse_parameter(const Route& route, const Request& request) {
  if (route.pattern.find("{hash}") == std::string_view::npos || proto::is_content_hash(request.parameter))
    return std::nullopt;
  constexpr const char* kMend = "Write sha256: and 64 lower-case hexadecimal digits.";
  if (route.body != Body::file) return Problem{ProblemCode::not_found, std::string("No hash looks so. ") + kMend, {}};
  return Problem{ProblemCode::invalid_document, "The path doesn't end in a content hash.", {{"{hash}", kMend}}};
}

std::optional<Problem> refuse_query(const Route& route, const Request& request) {
  QueryErrors errors;
  const auto& query = request.target.query;
  for (auto at = query.begin(); at != query.end(); ++at) {
    if (std::ranges::find(route.query, at->first) == route.query.end())
      errors.add(at->first, route.query.empty() ? "There is no such parameter; this resource takes none."
                                                : "There is no such parameter; known: " + listed(route.query) + ".");
    else if (std::any_of(query.begin(), at, [&](const auto& earlier) { return earlier.first == at->first; }))
      errors.add(at->first, "It is given twice; give it once.");
  }
  if (errors.empty()) return std::nullopt;
  return std::move(errors).as_problem();
}

std::optional<Problem> refuse_body(const Route& route, const Request& request) {
  if (route.body != Body::json && route.body != Body::asset) return std::nullopt;
  if (route.body == Body::json && !is_media_type(request.header("content-type").value_or(""), "application/json"))
    return Problem{
        ProblemCode::unsupported_media_type, "Send JSON, with the header Content-Type: application/json.", {}};
  if (const auto encoding = request.header("content-encoding"); encoding && *encoding != "identity")
    return Problem{ProblemCode::unsupported_media_type, "Send the body as it is, without a Content-Encoding.", {}};
  return std::nullopt;
}

/// Methods that are known here (RFC 9110, 9; RFC 5789), though no route may have them. CONNECT isn't: this is no proxy.
constexpr std::string_view kMethods[] = {"GET", "HEAD", "POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE"};

void allow(std::vector<std::string_view>& allowed, std::string_view method) {
  if (std::ranges::find(allowed, method) == allowed.end()) allowed.push_back(method);
  if (method == "GET") allow(allowed, "HEAD");
}

}  // namespace

std::variant<const Route*, Response> find_route(const Config& config, Request& request) {
  if (std::ranges::find(kMethods, request.method) == std::end(kMethods))
    return problem_response({ProblemCode::not_implemented, "No resource of this server knows this method.", {}});
  std::vector<std::string_view> allowed;
  const bool is_for_server = request.target.segments.empty();
  for (const Route& route : route_table()) {
    if (route.is_of_drake && !config.drake) continue;
    const std::string of_drake = route.is_of_drake ? config.drake_prefix + std::string(route.pattern) : "";
    const std::string_view pattern = route.is_of_drake ? of_drake : route.pattern;
    auto parameter = is_for_server ? std::string() : match(pattern, request.target.segments);
    if (!parameter) continue;
    if (route.method != request.method) {
      allow(allowed, route.method);
      continue;
    }
    request.parameter = *std::move(parameter);
    request.route = static_cast<std::size_t>(&route - route_table().data());
    return &route;
  }
  if (allowed.empty())
    return problem_response(
        {ProblemCode::not_found, "There is nothing at this path; GET /openapi.json lists all.", {}});
  allow(allowed, "OPTIONS");
  if (request.method == "OPTIONS") return Response{204, {{"Allow", listed(allowed)}}, ""};
  Response response =
      problem_response({ProblemCode::method_not_allowed, "This resource knows " + listed(allowed) + " only.", {}});
  response.headers.emplace_back("Allow", listed(allowed));
  return response;
}

std::optional<Response> refuse_request(const Route& route, const Request& request) {
  if (const auto problem = refuse_parameter(route, request)) return route.refuse(*problem);
  if (const auto problem = refuse_query(route, request)) return route.refuse(*problem);
  if (const auto problem = refuse_body(route, request)) return route.refuse(*problem);
  return std::nullopt;
}

Response run_handler(const Route& route, const Handler& handle, Services& services, Request& request) {
  try {
    return handle(services, request);
  } catch (const proto::Abandoned&) {
    return {};  // Nobody is there to read it.
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const StorageError& error) {
    if (request.abandoned.stop_requested()) return {};
    return route.refuse(refuse(error));
  } catch (const std::exception& error) {
    if (request.abandoned.stop_requested()) return {};  // The reason, and nobody waits to hear it.
    spdlog::error("{} {}: {}", route.method, route.pattern, error.what());
    return route.refuse({ProblemCode::internal_error, "The server failed to answer; its log says why.", {}});
  }
}

std::string describe_routes() {
  std::string text;
  for (const Route& route : route_table()) {
    text += std::string(route.method) + ' ' + std::string(route.pattern);
    for (const std::string_view name : route.query) text += ' ' + std::string(name);
    text += '\n';
  }
  return text;
}

}  // namespace tessera::server

#include "server/http/cross_site.h"

#include <algorithm>
#include <string_view>

#include "proto/wire/printable.h"
#include "server/http/http_syntax.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

namespace {

constexpr std::string_view kLoopback[] = {"localhost", "127.0.0.1", "::1"};
/// Headers of answers that scripts may read, beside those that all may.
constexpr const char* kExposed =
    "Accept-Ranges, Content-Range, ETag, Link, Location, Preference-Applied, RateLimit-Limit, RateLimit-Remaining, "
    "RateLimit-Reset, Retry-After, Server-Timing, WWW-Authenticate";
/// How long a browser may remember what it was allowed.
constexpr const char* kRememberedSeconds = "600";

bool is_allowed(const Config& config, std::string_view origin) {
  return std::ranges::find(config.cors_origins, origin) != config.cors_origins.end();
}

/// Whether a page comes from here. What is before this server may speak TLS, so that the scheme says nothing.
bool is_own(const Request& request, std::string_view origin) {
  const std::size_t scheme_end = origin.find("://");
  return scheme_end != std::string_view::npos &&
         equal_but_for_case(origin.substr(scheme_end + 3), request.host().value_or(""));
}

bool is_safe(const Request& request) { return request.method == "GET" || request.method == "OPTIONS"; }

}  // namespace

std::optional<Problem> refuse_host(const Config& config, const Request& request, const std::string& local_address) {
  const auto given = request.host();
  if (!given) return std::nullopt;  // HTTP/1.0, which no browser speaks.
  const std::string host = canonical_host(*given);
  const auto is_it = [&](std::string_view name) { return canonical_host(name) == host; };
  const bool is_ours = std::ranges::find(kLoopback, host) != std::end(kLoopback) ||
                       std::ranges::any_of(config.host_names, is_it) || config.host == host || is_it(local_address);
  if (is_ours) return std::nullopt;
  return Problem{ProblemCode::misdirected_request,
                 "This server isn't called \"" + proto::printable(*given) + "\". If it should be, start it with " +
                     "--host-name " + proto::printable(host.empty() ? "NAME" : host) + ".",
                 {}};
}

std::optional<Problem> refuse_origin(const Config& config, const Request& request) {
  if (is_safe(request)) return std::nullopt;
  const auto origin = request.header("origin"), site = request.header("sec-fetch-site");
  if (origin ? is_allowed(config, *origin) : !site) return std::nullopt;
  const bool is_from_here = !origin || is_own(request, *origin);
  if (is_from_here && (!site || *site == "same-origin" || *site == "none")) return std::nullopt;
  const std::string page = origin ? "of the origin " + proto::printable(*origin) : std::string("of another site");
  return Problem{ProblemCode::forbidden,
                 "A web page " + page + " may send no such request. If it should, start the server with --cors-origin.",
                 {}};
}

void allow_origin(const Config& config, const Request& request, Response& response) {
  if (config.cors_origins.empty()) return;
  response.headers.emplace_back("Vary", "Origin");
  const auto origin = request.header("origin");
  if (!origin || !is_allowed(config, *origin)) return;
  response.headers.emplace_back("Access-Control-Allow-Origin", *origin);
  if (request.method != "OPTIONS" || !request.header("access-control-request-method")) {
    response.headers.emplace_back("Access-Control-Expose-Headers", kExposed);
    return;
  }
  const auto allow = std::ranges::find(response.headers, "Allow", [](const auto& header) { return header.first; });
  if (allow == response.headers.end()) return;
  const std::string methods = allow->second;
  response.headers.emplace_back("Access-Control-Allow-Methods", methods);
  response.headers.emplace_back("Access-Control-Max-Age", kRememberedSeconds);
  response.headers.emplace_back("Vary", "Access-Control-Request-Method, Access-Control-Request-Headers");
  if (const auto wanted = request.header("access-control-request-headers"))
    response.headers.emplace_back("Access-Control-Allow-Headers", *wanted);
}

}  // namespace tessera::server

#pragma once

#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "proto/wire/key_file.h"
#include "server/config.h"
#include "server/http/request.h"
#include "server/http/response.h"
#include "server/services.h"

namespace tessera::server {

/// What a route takes as its body: a document; a file that is to have the hash in the path; or a file of any type,
/// which the handler finds out.
enum class Body { none, json, file, asset };

/// Where a handler runs: on an I/O thread what is answered from memory; in the quick lane what has little to do unless
/// its document is large, or names large files; in the slow lane all else that computes or touches the disk.
enum class Place { io, quick, slow };

/// A row of the one table of routes.
struct Route {
  std::string_view method;
  std::string_view pattern;  ///< A segment {hash} has to be a content hash, {id} may be anything.
  std::vector<std::string_view> query;
  Body body;
  Place place;
  Response (*handle)(Services&, Request&);
  /// How it is told what is wrong with a request.
  Response (*refuse)(const proto::Problem&) = problem_response;
  bool is_of_drake = false;  ///< It is there only with `Config::drake`, under its prefix.
  /// What who shows a key needs it to have; nothing where none has to be shown.
  std::optional<proto::Scope> needs = method == "GET" ? proto::Scope::read : proto::Scope::submit;
};
std::span<const Route> route_table();

/// Finds the route of a request among those that the settings allow, and sets its `route` and `parameter`; or the
/// answer, where there is none: to OPTIONS, and refusals: unknown path, wrong method.
std::variant<const Route*, Response> find_route(const Config& config, Request& request);

/// What is wrong with a request for a route before its body is read: a hash that isn't one, query parameters that the
/// route doesn't know, or a body of a type that it doesn't take.
std::optional<Response> refuse_request(const Route& route, const Request& request);

/// Runs a handler of the route, its own or one that goes on for it. A StorageError becomes what `refuse`
/// says, any other exception a logged `internal_error`; std::bad_alloc and TooHeavy are passed on. Of a request that
/// was abandoned the response means nothing: nobody reads it.
Response run_handler(const Route& route, const Handler& handle, Services& services, Request& request);

/// The table as text, one route a line: "GET /v1/jobs after limit state".
std::string describe_routes();

}  // namespace tessera::server

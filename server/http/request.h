#pragma once

#include <cstddef>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/http/principal.h"
#include "server/store/received_file.h"

namespace tessera::server {

/// A request target, decoded.
struct Target {
  std::vector<std::string> segments;  ///< Of the path: "/v1/jobs" is {"v1", "jobs"}, "/" is {""}; none: the server.
  std::vector<std::pair<std::string, std::string>> query;
  std::string authority = {};  ///< "host" or "host:port" of a target in absolute form; empty in any other.
};

/// Splits "/path?query" (or "http://host/path?query") and undoes percent encoding. Nothing when it isn't one
/// (RFC 9112, 3.2; RFC 9110, 4.2.1).
std::optional<Target> parse_target(std::string_view given);

/// Of a request that fits no route.
inline constexpr std::size_t kNoRoute = std::numeric_limits<std::size_t>::max();

/// What a handler sees of a request: nothing of sockets.
struct Request {
  std::string id;        ///< Its own: `request_id`.
  std::string method;    ///< "GET" also where HEAD was asked: the session leaves the body away.
  bool is_head = false;  ///< HEAD was asked.
  Target target;
  std::map<std::string, std::string> headers;  ///< Names in lower case; repeated ones joined by ", ".
  std::size_t route = kNoRoute;                ///< Its place in the table of routes, once it is known.
  std::string parameter;                       ///< The path segment that stands at the route's {…}; may be empty.
  std::string body;                            ///< Where the route takes a document.
  std::shared_ptr<ReceivedFile> file;          ///< Where the route takes a file.
  Principal who;
  std::stop_token abandoned;  ///< Requested when nobody waits for the answer any more.

  /// Whom it is for, as "host" or "host:port" (RFC 9112, 3.2.2): what the target says, or else the Host header; nothing
  /// where neither is there, as in HTTP/1.0.
  std::optional<std::string_view> host() const;
  /// The header's value, or nothing.
  std::optional<std::string_view> header(const std::string& lower_case_name) const;
  /// The first value of a query parameter, or nothing.
  std::optional<std::string_view> query(std::string_view name) const;
};

}  // namespace tessera::server

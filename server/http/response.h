#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "proto/wire/problem.h"
#include "server/http/stream.h"

namespace tessera::server {

struct Later;
struct Request;
struct Services;

/// What a handler answers.
struct Response {
  int status = 200;
  std::vector<std::pair<std::string, std::string>> headers;  ///< Content-Type among them where there is a body.
  std::string body;
  std::shared_ptr<const std::vector<std::byte>> shared_body =
      nullptr;  ///< In place of `body`, where others hold it too.
  /// First byte and size of what is sent of all that; nothing: all.
  std::optional<std::pair<std::size_t, std::size_t>> part = std::nullopt;
  bool has_length = true;                    ///< Not of an answer to HEAD for what would have to be made to know it.
  std::shared_ptr<Stream> stream = nullptr;  ///< In place of both bodies. The connection ends with it.
  std::shared_ptr<const Later> later = nullptr;  ///< Where there is one, this isn't the answer yet.

  std::string_view content() const;
};

/// A function that answers a request.
using Handler = std::function<Response(Services&, Request&)>;

/// The answer waits for a job, on no thread: it is what `then` answers, in the quick lane or else in the slow one, when
/// the job has ended, or at `until` if that comes first. A client that hangs up meanwhile lets go of `hold`.
struct Later {
  std::string job;
  std::optional<std::chrono::steady_clock::time_point> until;
  std::shared_ptr<const void> hold;
  Handler then;
  bool until_written = false;  ///< It waits for the job to be written down, not to end.
};

Response json_response(int status, const nlohmann::json& body);
/// The same of what is JSON text already.
Response json_text_response(int status, std::string text);

/// Problem details; with Retry-After where trying again can help.
Response problem_response(const proto::Problem& problem);
/// The same with members that this problem has beside those that all have (RFC 9457, 3.2).
Response problem_response(const proto::Problem& problem, const nlohmann::json& members);
/// The same as text, for clients that show it to people, and know the statuses 400 and 500 alone.
Response text_response(const proto::Problem& problem);

}  // namespace tessera::server

#pragma once

#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "proto/wire/problem.h"

namespace tessera::server {

/// What a handler answers.
struct Response {
  int status = 200;
  std::vector<std::pair<std::string, std::string>> headers;  ///< Content-Type among them where there is a body.
  std::string body;
};

Response json_response(int status, const nlohmann::json& body);

/// Problem details; with Retry-After where trying again can help.
Response problem_response(const proto::Problem& problem);

}  // namespace tessera::server

#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
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
  std::shared_ptr<const std::vector<std::byte>> shared_body =
      nullptr;             ///< In place of `body`, where others hold it too.
  bool has_length = true;  ///< Not of an answer to HEAD for what would have to be made to know it.

  std::string_view content() const;
};

Response json_response(int status, const nlohmann::json& body);

/// Problem details; with Retry-After where trying again can help.
Response problem_response(const proto::Problem& problem);

}  // namespace tessera::server

#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "client/failure.h"
#include "client/http.h"
#include "proto/wire/problem.h"

namespace tessera::client {

/// What an answer other than a success says, in the words of who uses the tool: the server speaks to programs that
/// send requests, and what those would have to do differently is done with options here.
Failure refusal(const HttpResponse& response);

/// The list of places and what is to be said of them under `key`; empty when there is none.
std::vector<proto::FieldError> field_errors(const nlohmann::json& document, const char* key);

}  // namespace tessera::client

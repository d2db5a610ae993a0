#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/http/response.h"

namespace tessera::server {

/// What a request is called in the log, in answers and in problems: what its X-Request-Id says, where that is 1 to 128
/// letters, digits and -._~:/+=@ (so that it can be copied anywhere as it is), and otherwise a new id, which no other
/// request has, of this process or another. For any thread.
std::string request_id(std::optional<std::string_view> given);

/// Has the answer carry the id: as X-Request-Id, and in problem details (RFC 9457) as `request_id`.
void add_request_id(Response& response, const std::string& id);

}  // namespace tessera::server

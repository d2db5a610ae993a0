#pragma once

#include <string>

#include "server/http/response.h"

namespace tessera::server {

/// Whether it has no body, whatever it holds (RFC 9110, 6.4.1).
bool is_bare(const Response& response);

/// The status line and the headers of a response, with the empty line at their end, to a request of HTTP/1.x, after
/// which the connection is kept or closed (RFC 9112).
std::string response_head(const Response& response, bool keeps_connection, int minor_version);

}  // namespace tessera::server

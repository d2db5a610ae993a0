#pragma once

#include "server/http/request.h"
#include "server/http/response.h"

namespace tessera::server {

/// Makes of the whole answer to a GET, which is there with its strong ETag, what the request asks for of its bytes (RFC
/// 9110, 14): 206 with a part, or 416. It stays whole where the request asks for no part, for several, or in a way that
/// isn't known here, and where its If-Range names another one.
void answer_range(const Request& request, Response& response);

}  // namespace tessera::server

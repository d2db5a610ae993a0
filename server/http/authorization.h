#pragma once

#include <optional>

#include "server/http/request.h"
#include "server/http/response.h"
#include "server/http/router.h"
#include "server/services.h"

namespace tessera::server {

/// Finds out who sends a request, which is `request.who` from then on, and whether they may use the route: 401 where
/// no valid key is shown, 403 where its scopes don't suffice, each with WWW-Authenticate (RFC 6750, 3); 429 where it
/// has no more requests.
std::optional<Response> refuse_stranger(Services& services, const Route& route, Request& request);

/// Adds what is left of the requests of the key that was shown (draft-ietf-httpapi-ratelimit-headers-07, with the three
/// headers that clients know).
void tell_quota(Services& services, const Request& request, Response& response);

}  // namespace tessera::server

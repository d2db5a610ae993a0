#pragma once

#include <optional>
#include <string>

#include "proto/wire/problem.h"
#include "server/config.h"
#include "server/http/request.h"
#include "server/http/response.h"

/// What web pages of others can't do: a browser reaches what the rest of the world can't, and sends requests there for
/// whatever page is open in it.
namespace tessera::server {

/// `misdirected_request` for a host that isn't this server: neither loopback by one of its names, nor `--host`, nor
/// `--host-name`, nor `local_address`, which the connection came to. Against DNS rebinding, where a page's own name is
/// turned onto an address that is none of the page's. Ports don't matter: tunnels and containers change them.
std::optional<proto::Problem> refuse_host(const Config& config, const Request& request,
                                          const std::string& local_address);

/// `forbidden` for a request that may change something and that a browser sends for a page of another origin than this
/// server, and than `--cors-origin`, as Origin or Sec-Fetch-Site tell (RFC 6454; Fetch Metadata). A page needn't ask
/// before it sends what a form can, a POST of text, say.
std::optional<proto::Problem> refuse_origin(const Config& config, const Request& request);

/// Adds what lets the scripts of an allowed origin read a response (Fetch, 3.3.3), and to an answer to OPTIONS, which
/// has Allow, what they may send.
void allow_origin(const Config& config, const Request& request, Response& response);

}  // namespace tessera::server

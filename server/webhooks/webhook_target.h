#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/result.h"

namespace tessera::server {

/// Where webhooks may go.
struct WebhookRules {
  /// "hooks.example.org", "hooks.example.org:8443", or "*.example.org", which are all names below it. Without a port it
  /// is the scheme's own alone. Where there are none, there are no webhooks.
  std::vector<std::string> hosts;
  bool allow_private = false;  ///< To addresses that the internet doesn't reach, too, and to those without TLS.
};

/// Whether `text` is one of `WebhookRules::hosts`.
bool is_webhook_host(std::string_view text);

/// Where one goes.
struct WebhookTarget {
  bool is_tls = true;
  std::string host;  ///< As `canonical_host` gives it: a name, or an address without brackets.
  std::uint16_t port = 0;
  std::string path;  ///< With the query.

  /// "host" or "host:port", as the header Host has it.
  std::string authority() const;
};

/// Reads the URL of a job's webhook. `invalid_document` at /webhook when it is none, or none that the rules allow; they
/// can't say here what a name's addresses will be.
proto::Result<WebhookTarget> read_webhook(const WebhookRules& rules, std::string_view url);

/// Of a URL that has been read: host and port, as they stand in it.
std::string_view host_of_webhook(std::string_view url);

}  // namespace tessera::server

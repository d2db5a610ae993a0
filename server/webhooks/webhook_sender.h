#pragma once

#include <chrono>
#include <memory>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "server/webhooks/webhook_retry.h"
#include "server/webhooks/webhook_target.h"

namespace tessera::server {

/// What is sent to a webhook's receiver.
struct WebhookRequest {
  std::vector<std::pair<std::string, std::string>> headers;  ///< Beside those of every POST of JSON.
  std::string body;
};

/// Sends webhooks by HTTP/1.1. Safe to use from any number of threads.
class WebhookSender {
 public:
  /// Reads whom the system trusts (SSL_CERT_FILE and SSL_CERT_DIR say otherwise). `most` is how long connecting and
  /// the answer may take together.
  WebhookSender(bool allow_private, std::chrono::milliseconds most);
  ~WebhookSender();
  WebhookSender(const WebhookSender&) = delete;

  /// Sends one and waits for the head of its answer, whose body isn't read; a redirection is an answer like others. The
  /// name is looked up, which may take as long as the system lets it; the addresses are looked at, and the connection
  /// goes to one of those that are allowed and to nothing else. Ends soon once `stop` is requested.
  WebhookAnswer send(const WebhookTarget& target, const WebhookRequest& request, const std::stop_token& stop) const;

 private:
  struct Trust;
  const std::unique_ptr<Trust> trust_;
  const bool allow_private_;
  const std::chrono::milliseconds most_;
};

}  // namespace tessera::server

#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tessera::server {

/// What webhooks are signed with, so that who receives one knows that this server sent it: secrets that both have, as
/// Standard Webhooks (https://www.standardwebhooks.com) has them. Several, while receivers change from one to another.
class WebhookSecrets {
 public:
  /// A file with a secret a line, "whsec_" and 24 to 64 bytes in base64. Throws std::runtime_error, which names the
  /// file and no secret, when it can't be read, holds something else, or can be read by every user of this machine.
  explicit WebhookSecrets(const std::filesystem::path& file);
  ~WebhookSecrets();
  WebhookSecrets(const WebhookSecrets&) = delete;

  /// The header webhook-signature: "v1," and the HMAC with SHA-256 of "id.time.body" in base64, for each secret. `id`
  /// is the header webhook-id, `time` webhook-timestamp.
  std::string sign(std::string_view id, std::chrono::sys_seconds time, std::string_view body) const;

 private:
  std::vector<std::string> keys_;
};

}  // namespace tessera::server

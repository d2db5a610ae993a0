#pragma once

#include <string>

#include "server/jobs/job.h"

namespace tessera::server {

/// What is told of a job that has ended.
struct WebhookMessage {
  std::string id;    ///< The same each time that it is sent, so that a receiver knows what it had before.
  std::string body;  ///< JSON.
};
WebhookMessage webhook_message(const JobView& job);

}  // namespace tessera::server

#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "server/jobs/job_event.h"

namespace tessera::server {

/// What came of sending a webhook.
struct WebhookAnswer {
  unsigned status = 0;     ///< Of HTTP; 0 where no answer came.
  std::string error = {};  ///< Why none came.
  std::optional<std::chrono::seconds> retry_after = {};
};

/// What follows from that. 2xx is a delivery, 410 the end of it (the receiver has gone), and all else is tried again
/// for about a day: the later the longer it has been due, or when Retry-After says; ten times at most sooner than
/// without it. `before` is how often it had been tried, `random` a number from 0 to 1, so that not all come back at
/// once.
JobEvent::WebhookTried what_follows(const WebhookAnswer& answer, std::uint32_t before,
                                    std::chrono::steady_clock::duration due_for, double random);

}  // namespace tessera::server

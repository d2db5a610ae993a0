#include "server/webhooks/webhook_retry.h"

#include <algorithm>
#include <iterator>

namespace tessera::server {
namespace {

using namespace std::chrono_literals;

/// How long after each try the next one follows, more or less.
constexpr std::chrono::seconds kRetryDelays[] = {5s, 30s, 2min, 10min, 30min, 1h, 2h, 4h, 6h, 10h};
constexpr double kRetryVaries = 0.2;
/// What a receiver may ask for.
constexpr std::chrono::seconds kLeastRetryAfter = 1s, kMostRetryAfter = 6h;

constexpr unsigned kGone = 410;

}  // namespace

JobEvent::WebhookTried what_follows(const WebhookAnswer& answer, std::uint32_t before, double random) {
  using proto::WebhookState;
  if (answer.status >= 200 && answer.status < 300) return {WebhookState::delivered};
  std::string why = answer.status == 0 ? answer.error : "it answered " + std::to_string(answer.status);
  if (answer.status == kGone || before >= std::size(kRetryDelays)) return {WebhookState::failed, std::move(why)};
  if (answer.retry_after)
    return {WebhookState::pending, std::move(why), std::clamp(*answer.retry_after, kLeastRetryAfter, kMostRetryAfter)};
  const std::chrono::duration<double> delay = kRetryDelays[before] * (1 + kRetryVaries * (2 * random - 1));
  return {WebhookState::pending, std::move(why),
          std::chrono::duration_cast<std::chrono::steady_clock::duration>(delay)};
}

}  // namespace tessera::server

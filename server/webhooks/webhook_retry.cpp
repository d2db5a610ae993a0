#include "server/webhooks/webhook_retry.h"

#include <algorithm>
#include <optional>

namespace tessera::server {
namespace {

using namespace std::chrono_literals;

/// How long after each try the next one follows, more or less, where receivers don't say.
constexpr std::chrono::seconds kRetryDelays[] = {5s, 30s, 2min, 10min, 30min, 1h, 2h, 4h, 6h, 10h};
constexpr double kRetryVaries = 0.2;
/// What a receiver may ask for.
constexpr std::chrono::seconds kLeastRetryAfter = 1s, kMostRetryAfter = 6h;
constexpr std::uint32_t kMostSooner = 10;

constexpr unsigned kGone = 410;

/// Which of the delays it is when it has been tried for so long; nothing when that is long enough.
std::optional<std::chrono::seconds> next_delay(std::chrono::steady_clock::duration due_for) {
  std::chrono::seconds all{0};
  for (const std::chrono::seconds delay : kRetryDelays)
    if ((all += delay) > due_for) return delay;
  return std::nullopt;
}

}  // namespace

JobEvent::WebhookTried what_follows(const WebhookAnswer& answer, std::uint32_t before,
                                    std::chrono::steady_clock::duration due_for, double random) {
  using proto::WebhookState;
  if (answer.status >= 200 && answer.status < 300) return {WebhookState::delivered};
  std::string why = answer.status == 0 ? answer.error : "it answered " + std::to_string(answer.status);
  const auto usual = next_delay(due_for);
  if (answer.status == kGone || !usual) return {WebhookState::failed, std::move(why)};
  if (answer.retry_after && (before < kMostSooner || *answer.retry_after > *usual))
    return {WebhookState::pending, std::move(why), std::clamp(*answer.retry_after, kLeastRetryAfter, kMostRetryAfter)};
  const std::chrono::duration<double> delay = *usual * (1 + kRetryVaries * (2 * random - 1));
  return {WebhookState::pending, std::move(why),
          std::chrono::duration_cast<std::chrono::steady_clock::duration>(delay)};
}

}  // namespace tessera::server

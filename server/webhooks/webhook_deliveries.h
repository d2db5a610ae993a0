#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "server/jobs/event_feed.h"
#include "server/jobs/job_table.h"
#include "server/webhooks/webhook_queue.h"
#include "server/webhooks/webhook_retry.h"
#include "server/webhooks/webhook_secret.h"
#include "server/webhooks/webhook_sender.h"
#include "server/webhooks/webhook_target.h"

namespace tessera::server {

/// Delivers the webhooks of jobs that have ended, on threads of its own. Which are due follows from the table of jobs,
/// and so from the journal: of a job that has ended, and whose webhook is pending. What comes of a try is written
/// there, too, a moment later: after a crash a receiver may be told twice, and knows by the id, and never not at all.
class WebhookDeliveries final : private EventFeed::Watcher {
 public:
  /// `WebhookSender::send`, or what a test has in its place.
  using Send = std::function<WebhookAnswer(const WebhookTarget&, const WebhookRequest&, const std::stop_token&)>;

  /// Begins at once. The table lives longer, and knows the jobs of earlier daemons. Throws as `WebhookSecrets` does.
  WebhookDeliveries(JobTable& jobs, const WebhookRules& rules, const std::filesystem::path& secret, Send send);
  ~WebhookDeliveries();
  WebhookDeliveries(const WebhookDeliveries&) = delete;

  /// Reads the secrets again, for what is sent from now on. When that throws, they are as they were.
  void reload();

  /// Webhooks that are on their way, or due.
  std::size_t pressing() const;

  /// Begins nothing more, and interrupts what can be. False when something goes on after so long.
  bool shut_down(std::chrono::milliseconds patience);

 private:
  using Clock = std::chrono::steady_clock;

  void told() noexcept override;
  void stop();
  void end();
  void work_on(const std::stop_token& stop);
  void look_at_feed() noexcept;
  void add(const std::string& id);
  /// Who sends to whom.
  std::string lane_of(const JobView& job) const;
  /// One that has been taken from the queue.
  void deliver(std::string id, const std::stop_token& stop) noexcept;
  /// When it is due again; nothing when it isn't.
  std::optional<Clock::time_point> try_to_deliver(const JobView& job, const std::stop_token& stop);
  WebhookAnswer send(const JobView& job, const WebhookTarget& target, const std::stop_token& stop) const;

  JobTable& jobs_;
  const WebhookRules rules_;
  const std::filesystem::path secret_;
  const Send send_;
  EventId seen_;  ///< The last event that was looked at; belongs to who is looking.

  mutable std::mutex mutex_;                   ///< Guards what follows; held while no other part is called.
  std::condition_variable changed_, stopped_;  ///< For who works, and for who waits for the end of that.
  std::shared_ptr<const WebhookSecrets> secrets_;
  WebhookQueue queue_;
  bool has_news_ = true;       ///< There may be something in the feed,
  Clock::time_point news_at_;  ///< to be looked at from then on.
  bool is_looking_ = false, is_watching_ = false;
  unsigned at_work_ = 0;
  std::vector<std::jthread> threads_;
};

}  // namespace tessera::server

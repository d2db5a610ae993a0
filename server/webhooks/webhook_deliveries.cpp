#include "server/webhooks/webhook_deliveries.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <random>
#include <string_view>
#include <utility>

#include <spdlog/spdlog.h>

#include "server/metrics/metrics.h"
#include "server/webhooks/webhook_message.h"

namespace tessera::server {
namespace {

/// They wait for receivers. No more than so many go to one receiver for one owner at a time.
constexpr unsigned kSenders = 16, kSendersOfLane = 4;
constexpr std::size_t kEventsAtOnce = 256;
/// After what went wrong here, and says nothing of the receiver.
constexpr std::chrono::seconds kAfterTrouble{60};

double random_part() {
  thread_local std::minstd_rand generator{std::random_device()()};
  return std::uniform_real_distribution<double>()(generator);
}

bool is_to_be_delivered(const JobView& job) {
  return !job.order->webhook.empty() && proto::has_ended(job.state) &&
         job.webhook.state == proto::WebhookState::pending;
}

void log_try(const JobView& job, const JobEvent::WebhookTried& tried) {
  const std::string_view host = host_of_webhook(job.order->webhook);
  const std::uint32_t attempts = job.webhook.attempts + 1;
  switch (tried.state) {
    case proto::WebhookState::delivered:
      return spdlog::info("job {}: webhook delivered to {} (attempt {})", job.id, host, attempts);
    case proto::WebhookState::pending:
      return spdlog::warn("job {}: webhook to {} failed (attempt {}), and again in {} s: {}", job.id, host, attempts,
                          std::chrono::duration_cast<std::chrono::seconds>(tried.delay).count(), tried.error);
    case proto::WebhookState::failed:
      return spdlog::error("job {}: webhook to {} given up (attempt {}): {}", job.id, host, attempts, tried.error);
  }
}

}  // namespace

WebhookDeliveries::WebhookDeliveries(JobTable& jobs, const WebhookRules& rules, const std::filesystem::path& secret,
                                     Send send)
    : jobs_(jobs),
      rules_(rules),
      secret_(secret),
      send_(std::move(send)),
      secrets_(std::make_shared<const WebhookSecrets>(secret)),
      queue_(kSendersOfLane) {
  try {
    for (unsigned i = 0; i < kSenders; ++i) {
      threads_.emplace_back([this](const std::stop_token& stop) { work_on(stop); });
      ::pthread_setname_np(threads_.back().native_handle(), "webhooks");  // As top -H tells them.
    }
  } catch (...) {
    end();
    throw;
  }
}

WebhookDeliveries::~WebhookDeliveries() { end(); }

void WebhookDeliveries::end() {
  stop();
  threads_.clear();
  std::unique_lock lock(mutex_);
  if (!is_watching_) return;
  lock.unlock();
  if (jobs_.events().stop_watching(std::nullopt, *this)) return;
  lock.lock();
  stopped_.wait(lock, [this] { return !is_watching_; });  // It is being told.
}

void WebhookDeliveries::reload() {
  auto secrets = std::make_shared<const WebhookSecrets>(secret_);
  const std::lock_guard lock(mutex_);
  secrets_ = std::move(secrets);
}

std::size_t WebhookDeliveries::pressing() const {
  const std::lock_guard lock(mutex_);
  return queue_.due(Clock::now()) + (has_news_ || is_looking_ ? 1 : 0);
}

void WebhookDeliveries::stop() {
  for (std::jthread& thread : threads_) thread.request_stop();
  const std::lock_guard lock(mutex_);
  changed_.notify_all();
}

bool WebhookDeliveries::shut_down(std::chrono::milliseconds patience) {
  stop();
  std::unique_lock lock(mutex_);
  return stopped_.wait_for(lock, patience, [this] { return at_work_ == 0; });
}

void WebhookDeliveries::told() noexcept {
  const std::lock_guard lock(mutex_);
  is_watching_ = false;
  has_news_ = true;
  changed_.notify_one();
  stopped_.notify_all();  // Before the lock is given back: after that this may be gone.
}

void WebhookDeliveries::work_on(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    const auto now = Clock::now();
    const bool may_look = has_news_ && !is_looking_, looks = may_look && now >= news_at_;
    const std::string* const job = looks ? nullptr : queue_.take(now);
    if (looks || job) {
      if (looks) has_news_ = false, is_looking_ = is_watching_ = true;
      ++at_work_;
      lock.unlock();
      looks ? look_at_feed() : deliver(*job, stop);
      lock.lock();
      --at_work_;
      stopped_.notify_all();
      continue;
    }
    auto due = queue_.next();
    if (may_look) due = std::min(due.value_or(Clock::time_point::max()), news_at_);
    due ? (void)changed_.wait_until(lock, *due) : changed_.wait(lock);
  }
}

void WebhookDeliveries::look_at_feed() noexcept {
  const bool is_watched = jobs_.events().watch(std::nullopt, *this);
  try {
    EventId last = seen_;
    for (auto events = jobs_.events().after(last, kEventsAtOnce, std::nullopt); last != seen_;
         events = jobs_.events().after(last, kEventsAtOnce, std::nullopt)) {
      for (const EventFeed::Event& event : events) {
        if (event.step == JobStep::ended) add(event.job);
        if (event.step) continue;
        const std::lock_guard lock(mutex_);
        queue_.remove(event.job);
        metrics().webhooks_pending = queue_.size();
      }
      seen_ = last;
    }
  } catch (const std::exception& error) {
    spdlog::error("looking for webhooks: {}", error.what());
    const std::lock_guard lock(mutex_);
    has_news_ = true;
    news_at_ = Clock::now() + kAfterTrouble;
  }
  const std::lock_guard lock(mutex_);
  if (!is_watched) is_watching_ = false;
  is_looking_ = false;
}

std::string WebhookDeliveries::lane_of(const JobView& job) const {
  const auto target = read_webhook(rules_, job.order->webhook);
  return job.order->owner + ' ' + (target ? target->authority() : "");  // No owner's name holds a space.
}

void WebhookDeliveries::add(const std::string& id) {
  const auto job = jobs_.find(id);
  if (!job || !is_to_be_delivered(*job)) return;
  const auto due = job->webhook.attempts == 0 ? *job->times.ended : job->webhook.due;
  const std::string lane = lane_of(*job);
  const std::lock_guard lock(mutex_);
  queue_.add(id, lane, due);
  metrics().webhooks_pending = queue_.size();
  changed_.notify_all();
}

void WebhookDeliveries::deliver(std::string id, const std::stop_token& stop) noexcept try {
  std::optional<Clock::time_point> again;
  try {
    const auto job = jobs_.find(id);  // It may be gone, or rendered again.
    if (job && is_to_be_delivered(*job)) again = try_to_deliver(*job, stop);
  } catch (const std::exception& error) {
    spdlog::error("job {}: its webhook can't be sent now: {}", id, error.what());
    again = Clock::now() + kAfterTrouble;
  }
  {
    const std::lock_guard lock(mutex_);
    again ? queue_.put_back(id, *again) : queue_.done(id);
    metrics().webhooks_pending = queue_.size();
    changed_.notify_all();  // The lane has room, or there is less time to wait.
  }
  if (!again && !stop.stop_requested()) add(id);  // It may have been rendered again, and have ended meanwhile.
} catch (const std::exception& error) {
  spdlog::error("job {}: its webhook waits for the next start: {}", id, error.what());
}

std::optional<WebhookDeliveries::Clock::time_point> WebhookDeliveries::try_to_deliver(const JobView& job,
                                                                                      const std::stop_token& stop) {
  const auto target = read_webhook(rules_, job.order->webhook);
  JobEvent::WebhookTried tried{proto::WebhookState::failed};
  if (target) {
    const WebhookAnswer answer = send(job, *target, stop);
    if (answer.status == 0 && stop.stop_requested()) return std::nullopt;  // The next daemon tries.
    tried = what_follows(answer, job.webhook.attempts, Clock::now() - *job.times.ended, random_part());
  } else {  // An earlier daemon was allowed to.
    tried.error = target.problem().errors.front().detail;
  }
  log_try(job, tried);
  ++metrics().webhook_attempts[static_cast<std::size_t>(tried.state)];
  const auto again = Clock::now() + tried.delay;
  const bool is_there = jobs_.webhook_tried(job.id, tried);
  return is_there && tried.state == proto::WebhookState::pending ? std::optional(again) : std::nullopt;
}

WebhookAnswer WebhookDeliveries::send(const JobView& job, const WebhookTarget& target,
                                      const std::stop_token& stop) const {
  std::shared_ptr<const WebhookSecrets> secrets;
  {
    const std::lock_guard lock(mutex_);
    secrets = secrets_;
  }
  WebhookMessage message = webhook_message(job);
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  std::string signatures = secrets->sign(message.id, now, message.body);
  return send_(target,
               {{{"webhook-id", std::move(message.id)},
                 {"webhook-timestamp", std::to_string(now.time_since_epoch().count())},
                 {"webhook-signature", std::move(signatures)}},
                std::move(message.body)},
               stop);
}

}  // namespace tessera::server

#include "server/jobs/quotas.h"

#include <algorithm>
#include <cmath>

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

namespace {

constexpr double kHour = 3600;

double burst_of(const proto::KeyLimits& limits) {
  return limits.burst ? std::max(*limits.burst, 1U) : std::max(1.0, std::ceil(*limits.requests_per_second));
}

/// Of what was `used` then, now.
double used_after(double used, std::chrono::steady_clock::duration time, double per_second) {
  return std::max(0.0, used - std::chrono::duration<double>(time).count() * per_second);
}

/// Whole seconds, at least one, until so much has come back.
std::uint32_t whole_seconds(double amount, double per_second) {
  return static_cast<std::uint32_t>(std::clamp(std::ceil(amount / per_second), 1.0, 1e9));
}

}  // namespace

std::optional<Problem> Quotas::take_request(const proto::Key& key, Clock::time_point now) {
  if (!key.limits.requests_per_second) return std::nullopt;
  const double rate = *key.limits.requests_per_second, burst = burst_of(key.limits);
  const std::lock_guard lock(mutex_);
  Bucket& bucket = buckets_[key.id].requests;
  bucket = {used_after(bucket.used, now - bucket.at, rate), now};
  if (bucket.used + 1 > burst)
    return Problem{ProblemCode::quota_exceeded,
                   "This key has no more requests now.",
                   {},
                   whole_seconds(bucket.used + 1 - burst, rate)};
  ++bucket.used;
  return std::nullopt;
}

std::optional<Problem> Quotas::take_samples(const proto::Key& key, std::uint64_t samples, Clock::time_point now) {
  if (!key.limits.samples_per_hour) return std::nullopt;
  const auto most = static_cast<double>(*key.limits.samples_per_hour), wanted = static_cast<double>(samples);
  if (samples > *key.limits.samples_per_hour)
    return Problem{ProblemCode::forbidden,
                   "The image takes up to " + std::to_string(samples) + " samples, and this key has " +
                       std::to_string(*key.limits.samples_per_hour) + " an hour; ask for fewer.",
                   {}};
  const std::lock_guard lock(mutex_);
  Bucket& bucket = buckets_[key.id].samples;
  bucket = {used_after(bucket.used, now - bucket.at, most / kHour), now};
  if (bucket.used + wanted > most)
    return Problem{ProblemCode::quota_exceeded,
                   "This key has used up its samples of the hour.",
                   {},
                   whole_seconds(bucket.used + wanted - most, most / kHour)};
  bucket.used += wanted;
  return std::nullopt;
}

void Quotas::give_samples_back(const proto::Key& key, std::uint64_t samples) {
  if (!key.limits.samples_per_hour) return;
  const std::lock_guard lock(mutex_);
  Bucket& bucket = buckets_[key.id].samples;
  bucket.used = std::max(0.0, bucket.used - static_cast<double>(samples));
}

std::optional<Quotas::Requests> Quotas::requests(const proto::Key& key, Clock::time_point now) const {
  if (!key.limits.requests_per_second) return std::nullopt;
  const double rate = *key.limits.requests_per_second, burst = burst_of(key.limits);
  double used = 0;
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = buckets_.find(key.id); found != buckets_.end())
      used = used_after(found->second.requests.used, now - found->second.requests.at, rate);
  }
  return Requests{static_cast<std::uint32_t>(burst), static_cast<std::uint32_t>(std::max(0.0, burst - used)),
                  std::chrono::seconds(used > 0 ? whole_seconds(used, rate) : 0)};
}

}  // namespace tessera::server

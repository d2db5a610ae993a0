#include "server/jobs/ledger.h"

#include <algorithm>
#include <utility>

namespace tessera::server {

/// Bytes that are booked, and those that are booked together with others.
struct Ledger::Booking {
  Booking(Ledger& its_ledger, std::string its_key, std::uint64_t its_bytes, std::shared_ptr<const void> its_shared)
      : ledger(its_ledger), shared_key(std::move(its_key)), bytes(its_bytes), shared(std::move(its_shared)) {}
  Booking(const Booking&) = delete;
  ~Booking() { ledger.end(bytes, shared_key); }

  Ledger& ledger;
  const std::string shared_key;  ///< Of one that is shared.
  const std::uint64_t bytes;
  const std::shared_ptr<const void> shared;
};

std::shared_ptr<const void> Ledger::book(const Need& need) {
  std::shared_ptr<const void> booking, shared;  // What fails ends when the lock has been given back.
  {
    const std::lock_guard lock(mutex_);
    const auto known = shared_.find(need.shared_key);
    if (known != shared_.end()) shared = known->second.lock();
    const std::uint64_t bytes = need.own_bytes + (shared ? 0 : need.shared_bytes);
    if (bytes > limit_ - std::min(booked_, limit_)) return nullptr;
    if (!shared) {
      shared = std::make_shared<const Booking>(*this, need.shared_key, need.shared_bytes, nullptr);
      booked_ += need.shared_bytes;
      shared_[need.shared_key] = shared;
    }
    booking = std::make_shared<const Booking>(*this, "", need.own_bytes, shared);
    booked_ += need.own_bytes;
  }
  shrink_caches();
  return booking;
}

std::uint64_t Ledger::booked() const {
  const std::lock_guard lock(mutex_);
  return booked_;
}

void Ledger::end(std::uint64_t bytes, const std::string& shared_key) {
  {
    const std::lock_guard lock(mutex_);
    booked_ -= bytes;
    // Another one may have booked the same anew meanwhile.
    if (const auto found = shared_.find(shared_key); found != shared_.end() && found->second.expired())
      shared_.erase(found);
  }
  if (freed_) freed_();
}

void Ledger::shrink_caches() {
  std::uint64_t kept = 0;
  for (const Cache& cache : caches_) kept += cache.bytes();
  const std::uint64_t room = limit_ - std::min(booked(), limit_);
  for (const Cache& cache : caches_) {
    if (kept <= room) return;
    const std::uint64_t has = cache.bytes(), others = kept - std::min(has, kept);
    const std::uint64_t may_have = room - std::min(others, room);
    cache.shrink(may_have);
    kept = others + std::min(has, may_have);
  }
}

}  // namespace tessera::server

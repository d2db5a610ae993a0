#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace tessera::server {

/// The memory for what jobs are worked on with: scenes, structures, plans. A job's share is booked before its work
/// begins, by an estimate; what caches keep for later jobs gives way to that. Safe to call from any number of threads.
class Ledger {
 public:
  /// What is kept without being needed: how much that is, and how to have it be so much at most.
  struct Cache {
    std::function<std::uint64_t()> bytes;
    std::function<void(std::uint64_t most)> shrink;
  };
  /// Caches come in the order in which they give way.
  Ledger(std::uint64_t limit, std::vector<Cache> caches) : limit_(limit), caches_(std::move(caches)) {}
  /// No booking is left by then.
  Ledger(const Ledger&) = delete;

  /// What a job's work takes.
  struct Need {
    std::string shared_key;      ///< Who need the same at the same time need it once.
    std::uint64_t shared_bytes;  ///< Scene and structure.
    std::uint64_t own_bytes;

    std::uint64_t bytes() const { return shared_bytes + own_bytes; }
  };
  /// Booked as long as a copy of that lives; null while there isn't room for it.
  std::shared_ptr<const void> book(const Need& need);

  std::uint64_t limit() const { return limit_; }
  std::uint64_t booked() const;

  /// Has `freed` called whenever a booking has ended, by the thread that ended it; before there is any.
  void when_freed(std::function<void()> freed) { freed_ = std::move(freed); }

 private:
  struct Booking;

  void end(std::uint64_t bytes, const std::string& shared_key);
  /// Has caches leave room for what is booked.
  void shrink_caches();

  const std::uint64_t limit_;
  const std::vector<Cache> caches_;
  std::function<void()> freed_;
  mutable std::mutex mutex_;  ///< Guards what follows; nothing is called while it is held.
  std::uint64_t booked_ = 0;
  std::map<std::string, std::weak_ptr<const void>> shared_;
};

}  // namespace tessera::server

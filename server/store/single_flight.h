#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "proto/wire/abandoned.h"
#include "server/http/lane.h"
#include "server/store/lru.h"

namespace tessera::server {

/// What a cache holds, and what has been asked of it.
struct CacheUsage {
  std::uint64_t hits, joined, misses;  ///< It was there; another one was having it made; it was made.
  std::uint64_t bytes, limit;
};

/// Values by key: each is made once however many ask for it at the same moment, by the thread that asked first, and
/// kept as long as it is among the most recently used that fit into so many bytes. What couldn't be made is told to all
/// who asked, and the next one tries again. Safe to call from any number of threads.
template <typename Value>
class SingleFlight {
 public:
  /// A value that has been made, and what keeping it takes; nothing there, and it isn't kept. What is kept may be
  /// another one than those have who asked until now.
  struct Made {
    Value value;
    std::optional<std::uint64_t> bytes;
    std::optional<Value> kept = std::nullopt;
  };
  /// Makes a value, or throws. `unwanted` is requested when all who asked for it have gone.
  using Make = std::function<Made(const std::stop_token& unwanted)>;

  /// A value, or what `Make` threw.
  struct Answer {
    std::optional<Value> value;
    std::exception_ptr error;
  };
  /// `shared` when another one had it made. Doesn't throw.
  using Done = std::function<void(const Answer&, bool shared)>;

  explicit SingleFlight(std::uint64_t limit) : limit_(limit), kept_(limit) {}

  /// Somebody who asked, and goes when nobody wants the answer any more, as long as there is this.
  using Asking = std::shared_ptr<const std::stop_callback<std::function<void()>>>;

  /// Calls `done` with the value: at once if it is there, after making it on this very thread if nobody else does, and
  /// otherwise later on the thread that makes it. Who has asked goes when `abandoned` is requested, and is told
  /// whatever becomes of it all the same.
  Asking get(const std::string& key, const Make& make, const Done& done, const std::stop_token& abandoned) {
    const Joined joined = join(key, done);
    if (joined.kept) {
      done({joined.kept, nullptr}, true);
      return nullptr;
    }
    auto asking = std::make_shared<const std::stop_callback<std::function<void()>>>(
        abandoned, [this, key, flight = joined.flight] { leave(key, flight); });
    if (joined.first) fly(key, joined.flight, make);
    return asking;
  }

  /// Returns the value. Who asks while another thread makes it waits, no longer than making it here would take: that
  /// thread is at work, and waits for nobody. In the quick lane nobody waits, but throws TooHeavy. Throws what `make`
  /// throws, and `Abandoned` once `abandoned` is requested, while `make` goes on as long as others wait.
  Value get(const std::string& key, const Make& make, const std::stop_token& abandoned) {
    for (;;) {
      const auto waiter = std::make_shared<Waiter>();  // Told even when the one who waits has gone.
      const Joined joined = join(key, [waiter](const Answer&, bool) {
        const std::lock_guard lock(waiter->mutex);
        waiter->answered = true;
        waiter->changed.notify_one();
      });
      if (joined.kept) return *joined.kept;
      const std::stop_callback leaving(abandoned, [&] { leave(key, joined.flight); });
      if (joined.first) fly(key, joined.flight, make);
      std::unique_lock lock(waiter->mutex);
      if (!waiter->changed.wait(lock, abandoned, [&] { return waiter->answered; })) throw proto::Abandoned();
      const Answer& answer = joined.flight->answer;
      if (!answer.error) return *answer.value;
      try {
        std::rethrow_exception(answer.error);
      } catch (const TooHeavy&) {  // For the lane of who made it; here it is made anew.
        if (joined.first) throw;
      }
    }
  }

  /// The value, if it is kept.
  std::optional<Value> find(const std::string& key) {
    const std::lock_guard lock(mutex_);
    auto kept = kept_.find(key);
    if (kept) ++hits_;
    return kept;
  }

  /// Keeps so many bytes at most for now: the longest unused go.
  void shrink(std::uint64_t most) {
    Evicted evicted;
    const std::lock_guard lock(mutex_);
    kept_.shrink(most, evicted);
  }

  CacheUsage usage() const {
    const std::lock_guard lock(mutex_);
    return {hits_, joined_, misses_, kept_.bytes(), limit_};
  }

  /// The value that is kept, which is `value` from now on if there was none.
  Value find_or_keep(const std::string& key, Value value, std::uint64_t bytes) {
    Evicted evicted;  // Freed after the lock is.
    const std::lock_guard lock(mutex_);
    if (auto kept = kept_.find(key)) return *std::move(kept);
    kept_.put(key, value, bytes, evicted);
    return value;
  }

  /// Counts anew what a value takes, if it is the one that is kept.
  void recount(const std::string& key, const Value& value, std::uint64_t bytes) {
    Evicted evicted;
    const std::lock_guard lock(mutex_);
    if (const auto kept = kept_.find(key); kept && *kept == value) kept_.put(key, value, bytes, evicted);
  }

  /// Doesn't keep the value any more, if it is the one that is meant.
  template <typename IsMeant>
  void drop(const std::string& key, const IsMeant& is_meant) {
    Evicted evicted;
    const std::lock_guard lock(mutex_);
    if (const auto kept = kept_.find(key); kept && is_meant(*kept)) kept_.drop(key, evicted);
  }

  /// Keeps nothing any more whose key begins so.
  void drop_all(std::string_view prefix) {
    Evicted evicted;
    const std::lock_guard lock(mutex_);
    kept_.drop_all(prefix, evicted);
  }

 private:
  using Evicted = typename Lru<Value>::Evicted;

  struct Waiter {
    std::mutex mutex;
    std::condition_variable_any changed;
    bool answered = false;
  };

  /// A value in the making.
  struct Flight {
    std::vector<Done> asked;  ///< Who has to be told, the one first who makes it.
    std::size_t wanted = 1;   ///< By those who asked and haven't gone.
    std::stop_source unwanted;
    Answer answer;  ///< Complete, and constant, when they are told.
  };
  using FlightPtr = std::shared_ptr<Flight>;

  /// Either a value that is there, or a flight, of which the first is the one to make it.
  struct Joined {
    std::optional<Value> kept;
    FlightPtr flight;
    bool first = false;
  };

  Joined join(const std::string& key, const Done& done) {
    const std::lock_guard lock(mutex_);
    if (auto kept = kept_.find(key)) {
      ++hits_;
      return {std::move(kept), nullptr};
    }
    if (const auto found = flights_.find(key); found != flights_.end()) {
      if (FileBudget::is_limited()) throw TooHeavy{};
      found->second->asked.push_back(done);
      ++found->second->wanted;
      ++joined_;
      return {std::nullopt, found->second};
    }
    const auto flight = std::make_shared<Flight>();
    flight->asked.push_back(done);
    flights_.emplace(key, flight);
    ++misses_;
    return {std::nullopt, flight, true};
  }

  void fly(const std::string& key, const FlightPtr& flight, const Make& make) {
    Answer& answer = flight->answer;
    std::optional<std::uint64_t> bytes;
    std::optional<Value> kept;
    try {
      Made made = make(flight->unwanted.get_token());
      answer.value = std::move(made.value);
      bytes = made.bytes;
      kept = std::move(made.kept);
    } catch (...) {
      answer.error = std::current_exception();
    }
    Evicted evicted;
    std::vector<Done> asked;
    {
      const std::lock_guard lock(mutex_);
      forget(key, flight);
      asked = std::move(flight->asked);
      try {
        if (bytes) kept_.put(key, kept ? *std::move(kept) : *answer.value, *bytes, evicted);
      } catch (const std::bad_alloc&) {  // The next one who asks has it made again.
      }
    }
    for (std::size_t i = 0; i < asked.size(); ++i) asked[i](answer, i > 0);
  }

  void leave(const std::string& key, const FlightPtr& flight) {
    {
      const std::lock_guard lock(mutex_);
      if (--flight->wanted > 0) return;
      forget(key, flight);  // Who asks from now on begins anew.
    }
    flight->unwanted.request_stop();
  }

  void forget(const std::string& key, const FlightPtr& flight) {
    const auto found = flights_.find(key);
    if (found != flights_.end() && found->second == flight) flights_.erase(found);
  }

  const std::uint64_t limit_;
  mutable std::mutex mutex_;  ///< Guards what follows; nothing is called while it is held.
  Lru<Value> kept_;
  std::uint64_t hits_ = 0, joined_ = 0, misses_ = 0;
  std::unordered_map<std::string, FlightPtr> flights_;
};

}  // namespace tessera::server

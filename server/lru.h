#pragma once

#include <cstdint>
#include <list>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

namespace tessera::server {

/// Values by name, the least recently used of which go when all together hold more than `limit` bytes. A value
/// that is larger than the limit isn't kept at all. Not safe for several threads at once.
template <typename Value>
class Lru {
 public:
  explicit Lru(std::uint64_t limit) : limit_(limit) {}

  std::optional<Value> find(const std::string& key) {
    const auto found = by_key_.find(key);
    if (found == by_key_.end()) return std::nullopt;
    entries_.splice(entries_.begin(), entries_, found->second);
    return found->second->value;
  }

  /// Adds or replaces. What has to go is moved into `evicted`, so that the caller can destroy it without a lock.
  /// Nothing is added when that throws std::bad_alloc.
  void put(const std::string& key, Value value, std::uint64_t bytes, std::list<Value>& evicted) {
    if (const auto found = by_key_.find(key); found != by_key_.end()) drop(found->second, evicted);
    std::list<Entry> added;
    added.push_front({key, std::move(value), bytes});
    by_key_[key] = added.begin();
    entries_.splice(entries_.begin(), added);
    bytes_ += bytes;
    while (bytes_ > limit_) drop(std::prev(entries_.end()), evicted);
  }

  std::uint64_t bytes() const { return bytes_; }

 private:
  struct Entry {
    std::string key;
    Value value;
    std::uint64_t bytes;
  };

  void drop(typename std::list<Entry>::iterator entry, std::list<Value>& evicted) {
    evicted.push_back(std::move(entry->value));  // The one step that may throw.
    bytes_ -= entry->bytes;
    by_key_.erase(entry->key);
    entries_.erase(entry);
  }

  std::uint64_t limit_;
  std::uint64_t bytes_ = 0;
  std::list<Entry> entries_;  ///< The most recently used first.
  std::unordered_map<std::string, typename std::list<Entry>::iterator> by_key_;
};

}  // namespace tessera::server

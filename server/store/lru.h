#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace tessera::server {

/// Values by name, the least recently used of which go when all together take more than `limit` bytes, names and what
/// it takes to find them included. A value that is larger than the limit isn't kept at all. Not safe for several
/// threads at once.
template <typename Value>
class Lru {
 public:
  struct Entry {
    std::string key;
    Value value;
    std::uint64_t bytes;
  };
  /// What has gone, for the caller to destroy when it holds no lock.
  using Evicted = std::list<Entry>;

  explicit Lru(std::uint64_t limit) : limit_(limit) {}

  std::optional<Value> find(const std::string& key) {
    const auto found = by_key_.find(key);
    if (found == by_key_.end()) return std::nullopt;
    entries_.splice(entries_.begin(), entries_, found->second);
    return found->second->value;
  }

  /// Adds or replaces. std::bad_alloc leaves nothing of that name.
  void put(const std::string& key, Value value, std::uint64_t bytes, Evicted& evicted) {
    if (const auto found = by_key_.find(key); found != by_key_.end()) drop(found, evicted);
    std::list<Entry> entry;
    entry.push_back({key, std::move(value), bytes + overhead(key)});
    by_key_.emplace(entry.front().key, entry.begin());
    bytes_ += entry.front().bytes;
    entries_.splice(entries_.begin(), entry);
    shrink(limit_, evicted);
  }

  /// The least recently used go until all together take so much at most.
  void shrink(std::uint64_t most, Evicted& evicted) {
    while (bytes_ > most) drop(by_key_.find(entries_.back().key), evicted);
  }

  void drop(std::string_view key, Evicted& evicted) {
    if (const auto found = by_key_.find(key); found != by_key_.end()) drop(found, evicted);
  }

  /// Drops all whose name begins so.
  void drop_all(std::string_view prefix, Evicted& evicted) {
    for (auto at = by_key_.lower_bound(prefix); at != by_key_.end() && at->first.starts_with(prefix);)
      at = drop(at, evicted);
  }

  std::uint64_t bytes() const { return bytes_; }

  /// What an entry takes beside its value: its name, and a node of the list and one of the map.
  static constexpr std::uint64_t overhead(std::string_view key) {
    constexpr std::uint64_t kLinks = 8 * sizeof(void*);
    return key.size() + sizeof(Entry) + sizeof(typename Map::value_type) + kLinks;
  }

 private:
  using Map = std::map<std::string_view, typename std::list<Entry>::iterator>;

  typename Map::iterator drop(typename Map::iterator found, Evicted& evicted) {
    bytes_ -= found->second->bytes;
    evicted.splice(evicted.end(), entries_, found->second);
    return by_key_.erase(found);
  }

  std::uint64_t limit_;
  std::uint64_t bytes_ = 0;
  std::list<Entry> entries_;  ///< The most recently used first.
  Map by_key_;                ///< Names are those of the entries.
};

}  // namespace tessera::server

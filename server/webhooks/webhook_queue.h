#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

namespace tessera::server {

/// Which webhooks are to be sent, and whose turn it is. Each has a lane; the lane goes first of which the fewest are on
/// their way, of such the one with what is due longest, and of none are more on their way than so many. So a receiver
/// that doesn't answer holds up others little. Not safe to use from several threads.
class WebhookQueue {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit WebhookQueue(unsigned most_of_lane) : most_of_lane_(most_of_lane) {}

  /// A job's webhook is due from then on. One that is there already, or on its way, stays as it is.
  void add(const std::string& job, const std::string& lane, Time due);

  /// The job whose webhook is to be sent now, or null: it is on its way until `done` or `put_back`, and this is there
  /// so long. None of these three takes memory.
  const std::string* take(Time now);
  void done(const std::string& job);
  /// It is due again from then on.
  void put_back(const std::string& job, Time due);

  /// One that waits isn't to be sent any more. Nothing happens to others.
  void remove(const std::string& job);

  /// When there may be one to take; nothing where that needs one of the others before.
  std::optional<Time> next() const;

  /// That haven't been taken, or are on their way.
  std::size_t size() const { return jobs_.size(); }
  /// Of these, those that are on their way or due.
  std::size_t due(Time now) const;

 private:
  using Jobs = std::set<std::pair<Time, std::string>>;  ///< By when they are due.
  struct Lane {
    Jobs waiting, on_their_way;
  };
  using Lanes = std::map<std::string, Lane>;
  Jobs::node_type take_back(Lane& lane, const std::string& job);
  void remove_if_empty(Lanes::iterator lane);

  struct Place {
    std::string lane;
    Time due;
  };

  const std::size_t most_of_lane_;
  Lanes lanes_;  ///< None is empty.
  std::map<std::string, Place> jobs_;
};

}  // namespace tessera::server

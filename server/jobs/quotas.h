#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "proto/wire/key_file.h"
#include "proto/wire/problem.h"

namespace tessera::server {

/// What keys' bearers have used of what their limits give them by time: token buckets, which are full at first and fill
/// as fast as the limit says. In memory: a start fills them. Safe to use from any number of threads.
class Quotas {
 public:
  using Clock = std::chrono::steady_clock;

  /// Takes one request of a key, or `quota_exceeded`, with the time until there is one.
  std::optional<proto::Problem> take_request(const proto::Key& key, Clock::time_point now = Clock::now());

  /// Takes samples of a job, or says why not: `quota_exceeded`, or `forbidden` where an hour's wouldn't do.
  std::optional<proto::Problem> take_samples(const proto::Key& key, std::uint64_t samples,
                                             Clock::time_point now = Clock::now());
  /// The job comes to nothing.
  void give_samples_back(const proto::Key& key, std::uint64_t samples);

  /// What is left of a key's requests.
  struct Requests {
    std::uint32_t limit;            ///< At once.
    std::uint32_t remaining;        ///< Now.
    std::chrono::seconds to_limit;  ///< Until they are as many as the limit again.
  };
  /// Nothing for a key without such a limit.
  std::optional<Requests> requests(const proto::Key& key, Clock::time_point now = Clock::now()) const;

 private:
  struct Bucket {
    double used = 0;  ///< At `at`.
    Clock::time_point at;
  };
  struct Buckets {
    Bucket requests, samples;
  };

  mutable std::mutex mutex_;                ///< Guards what follows.
  std::map<std::string, Buckets> buckets_;  ///< By the ids of keys.
};

}  // namespace tessera::server

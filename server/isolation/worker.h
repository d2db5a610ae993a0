#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "server/isolation/message.h"

namespace tessera::server {

/// What processes that read files and those who have them read say to each other.
enum class WorkerSays : std::uint32_t {
  asks,   ///< By the worker: the answer is a message, too.
  done,   ///< By the worker, as the last thing.
  ended,  ///< By the process that made it, in its stead: the worker has ended with the status (wait(2)) that follows.
  none,   ///< By the same: there can't be one, for the reason (errno) that follows.
};

/// A process of its own, made for one request, from inside. It is confined, has one thread, and of the daemon's files
/// and memory nothing but what the request brings.
class Worker {
 public:
  Worker(int channel, bool is_prepared, std::string why_not_prepared)
      : channel_(channel), is_prepared_(is_prepared), why_not_prepared_(std::move(why_not_prepared)) {}

  /// Whether it was to be prepared, and why it couldn't be; empty where it could.
  bool is_prepared() const { return is_prepared_; }
  const std::string& why_not_prepared() const { return why_not_prepared_; }

  /// The next thing that is said to it. Ends the process where nobody is there any more.
  Message hear() const;
  Message ask(std::string_view body) const;
  void done(std::string_view body) const;

 private:
  const int channel_;
  const bool is_prepared_;
  const std::string why_not_prepared_;
};

/// What a worker does with its request. What it throws ends it.
using Work = std::function<void(Worker& worker, Message request)>;

}  // namespace tessera::server

#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "server/jobs/event_feed.h"

namespace tessera::server {

/// A body that is written as there is something to write. What hasn't been written yet is nowhere: it is asked for when
/// the socket has taken all before. Used by one thread, but for the watcher.
class Stream {
 public:
  using Clock = std::chrono::steady_clock;

  virtual ~Stream() = default;

  struct Piece {
    std::string text;  ///< May be empty.
    bool is_last = false;
    Clock::time_point next;  ///< When there will be more, whether the watcher has been told or not.
  };
  /// What there is to be written now. Never waits.
  virtual Piece next(Clock::time_point now) = 0;
  /// Says nothing, to somebody who may have gone.
  virtual std::string_view filler() const = 0;
  /// How long it takes at least until the next piece, so that they aren't too many.
  virtual Clock::duration rest() const = 0;

  /// `watcher` is told when there may be more (`EventFeed::watch`).
  virtual bool watch(EventFeed::Watcher& watcher) noexcept = 0;
  virtual bool stop_watching(EventFeed::Watcher& watcher) noexcept = 0;
};

}  // namespace tessera::server

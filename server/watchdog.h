#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

#include "server/http/event_loop.h"
#include "server/http/task.h"
#include "server/service_manager.h"

namespace tessera::server {

/// Tells the service manager that this process isn't hung, as long as every event loop turns.
class Watchdog {
 public:
  Watchdog(const ServiceManager& manager, std::size_t loops) : manager_(manager), has_turned_(loops) {}

  bool is_wanted() const { return manager_.watchdog().has_value(); }

  /// To be resumed once for each loop, before that runs, where it is wanted; goes on as long as the
  /// loop does. Throws std::system_error when there is no file descriptor left.
  Detached watch(EventLoop& loop, std::size_t index);

 private:
  const ServiceManager& manager_;
  std::vector<std::atomic<bool>> has_turned_;  ///< By loop, since it was told last.
};

}  // namespace tessera::server

#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "server/store/file_descriptor.h"

namespace tessera::server {

/// Tells systemd how the service is (sd_notify(3)), where it has started this process and asks: otherwise nothing
/// happens. Safe to use from any number of threads.
class ServiceManager {
 public:
  /// Reads $NOTIFY_SOCKET, $WATCHDOG_USEC and $WATCHDOG_PID.
  ServiceManager();

  /// "READY=1", or several lines. Waits for a second at most, and doesn't fail: a service manager that doesn't listen
  /// is no reason not to serve.
  void tell(std::string_view state) const noexcept;

  /// "WATCHDOG=1", without waiting: another one follows.
  void tell_alive() const noexcept;

  /// "RELOADING=1" as it has to be told: with the time. "READY=1" follows when that is over.
  void tell_reloading() const noexcept;

  /// How often "WATCHDOG=1" has to be told at least, so that this process isn't taken for a hung one.
  std::optional<std::chrono::microseconds> watchdog() const { return watchdog_; }

 private:
  void send(std::string_view state, int flags) const noexcept;

  std::string address_;  ///< As sun_path has it; empty where nobody asks.
  FileDescriptor socket_;
  std::optional<std::chrono::microseconds> watchdog_;
};

}  // namespace tessera::server

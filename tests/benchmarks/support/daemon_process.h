#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <sys/types.h>

#include "client/http.h"

namespace tessera::bench {

/// A tesserad of its own on a free loopback port, with its data in a folder that goes with it.
class DaemonProcess {
 public:
  /// Returns once it listens. `flags` go to it beside its own. Throws std::runtime_error when it doesn't start.
  explicit DaemonProcess(const std::filesystem::path& program, const std::vector<std::string>& flags = {});
  ~DaemonProcess();
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;

  const client::ServerAddress& address() const { return address_; }

  /// What processors have spent on it by now, all its threads together.
  double cpu_seconds() const;

 private:
  pid_t process_ = -1;
  std::filesystem::path data_;
  client::ServerAddress address_;
};

}  // namespace tessera::bench

#pragma once

#include <string>

#include <signal.h>

namespace tessera::client {

/// From now on SIGINT and SIGTERM end the process with the exit code 128 + signal, and say `message` (which ends in a
/// line's end, or is empty) on stderr before. Signals that are ignored stay so. One thread at a time.
void on_interrupt(std::string message);

/// As long as it lives, those signals wait.
class InterruptsWait {
 public:
  InterruptsWait();
  ~InterruptsWait();
  InterruptsWait(const InterruptsWait&) = delete;
  InterruptsWait& operator=(const InterruptsWait&) = delete;

 private:
  sigset_t before_;
};

}  // namespace tessera::client

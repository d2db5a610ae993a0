#include "client/interrupt.h"

#include <utility>

#include <unistd.h>

namespace tessera::client {
namespace {

constexpr int kSignals[] = {SIGINT, SIGTERM};

std::string last_words;

sigset_t signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : kSignals) sigaddset(&set, signal);
  return set;
}

/// Calls only what a signal handler may (POSIX.1-2017, 2.4.3). `last_words` is whole here: it changes only while the
/// signals wait.
void end(int signal) {
  std::size_t written = 0;
  while (written < last_words.size()) {
    const ssize_t more = write(STDERR_FILENO, last_words.data() + written, last_words.size() - written);
    if (more <= 0) break;
    written += static_cast<std::size_t>(more);
  }
  _exit(128 + signal);
}

}  // namespace

void on_interrupt(std::string message) {
  const InterruptsWait wait;
  last_words = std::move(message);
  for (const int signal : kSignals) {
    struct sigaction action {};
    if (sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN) continue;
    action.sa_handler = end;
    sigaction(signal, &action, nullptr);
  }
}

InterruptsWait::InterruptsWait() {
  const sigset_t set = signals();
  sigprocmask(SIG_BLOCK, &set, &before_);
}

InterruptsWait::~InterruptsWait() { sigprocmask(SIG_SETMASK, &before_, nullptr); }

}  // namespace tessera::client

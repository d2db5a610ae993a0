#include "server/isolation/worker.h"

#include <optional>
#include <utility>

#include <unistd.h>

namespace tessera::server {

Message Worker::hear() const {
  std::optional<Message> message = receive_message(channel_);
  if (!message) ::_exit(0);
  return *std::move(message);
}

Message Worker::ask(std::string_view body) const {
  send_message(channel_, static_cast<std::uint32_t>(WorkerSays::asks), body);
  return hear();
}

void Worker::done(std::string_view body) const {
  send_message(channel_, static_cast<std::uint32_t>(WorkerSays::done), body);
}

}  // namespace tessera::server

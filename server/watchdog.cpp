#include "server/watchdog.h"

#include <algorithm>
#include <utility>

#include <sys/eventfd.h>

namespace tessera::server {

Detached Watchdog::watch(EventLoop& loop, std::size_t index) {
  const std::coroutine_handle<> coroutine = co_await ThisCoroutine{};
  // A loop wakes coroutines of channels only. Nothing ever happens to this one but that its time comes.
  FileDescriptor nothing(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  Channel channel(loop, std::move(nothing), coroutine);
  const auto interval = *manager_.watchdog() / 4;  // All loops turn within two of these.
  for (;;) {
    const auto next = Channel::Clock::now() + interval;
    channel.expires_at(next);
    while (Channel::Clock::now() < next) co_await channel.change();
    has_turned_[index] = true;
    if (!std::ranges::all_of(has_turned_, [](const auto& has) { return has.load(); })) continue;
    for (auto& has : has_turned_) has = false;
    manager_.tell_alive();
  }
}

}  // namespace tessera::server

#include "server/http/event_loop.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <coroutine>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "server/http/task.h"

namespace tessera::server {
namespace {

using Clock = Channel::Clock;
using namespace std::chrono_literals;

/// A connection's two ends: the one that a channel has, and the peer's.
std::pair<FileDescriptor, FileDescriptor> connected() {
  std::array<int, 2> ends{};
  EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends.data()), 0);
  return {FileDescriptor(ends[0]), FileDescriptor(ends[1])};
}

/// Waits for its peer until a deadline, if there is one; then says `name`, and stops the loop when all have.
Detached wait(EventLoop& loop, FileDescriptor socket, std::optional<Clock::duration> time, Clock::time_point got_on,
              std::string name, std::vector<std::string>& ended, std::size_t all) {
  const std::coroutine_handle<> coroutine = co_await ThisCoroutine{};
  Channel channel(loop, std::move(socket), coroutine);
  if (time) channel.expires_after(*time);
  channel.got_on(got_on);
  bool in_time = co_await channel.change_by_peer();  // Writable, to begin with.
  if (in_time) in_time = co_await channel.change_by_peer();
  ended.push_back(name + (in_time ? " hears" : channel.broken().stop_requested() ? " is given up" : " expires"));
  if (ended.size() == all) loop.stop();
}

TEST(EventLoop, WhoWaitsExpiresInTheOrderOfDeadlines) {
  EventLoop loop;
  std::vector<std::string> ended;
  std::vector<FileDescriptor> peers;
  const auto begin = [&](std::string name, std::optional<Clock::duration> time) {
    auto [ours, theirs] = connected();
    peers.push_back(std::move(theirs));
    wait(loop, std::move(ours), time, Clock::now(), std::move(name), ended, 3).handle.resume();
  };
  begin("last", 400ms);
  begin("never", std::nullopt);
  begin("first", 1ms);
  begin("second", 200ms);
  loop.run();
  EXPECT_EQ(ended, (std::vector<std::string>{"first expires", "second expires", "last expires"}));
}

/// Makes room as often as it can, from within an event, and says how often that was.
Detached make_room(EventLoop& loop, FileDescriptor socket, int& made, Clock::duration patience) {
  const std::coroutine_handle<> coroutine = co_await ThisCoroutine{};
  Channel channel(loop, std::move(socket), coroutine);
  bool was_made = true;
  for (made = -1; was_made; ++made) {  // The first time is for the others to begin to wait for their peers.
    EventLoop::Message after_events;
    after_events.to = &channel;
    loop.post(after_events);
    while (!after_events.is_done) co_await channel.change();
    was_made = loop.make_room(patience);
  }
  loop.stop();
}

TEST(EventLoop, RoomIsMadeByWhoHasWaitedLongest) {
  EventLoop loop;
  std::vector<std::string> ended;
  std::vector<FileDescriptor> peers;
  const auto begin = [&](std::string name, Clock::duration ago) {
    auto [ours, theirs] = connected();
    peers.push_back(std::move(theirs));
    wait(loop, std::move(ours), std::nullopt, Clock::now() - ago, std::move(name), ended, 9).handle.resume();
  };
  begin("young", 0s);
  begin("old", 2h);
  begin("oldest", 3h);
  int made = 0;
  auto [ours, theirs] = connected();
  make_room(loop, std::move(ours), made, 1h).handle.resume();
  loop.run();
  EXPECT_EQ(made, 2);
  EXPECT_EQ(ended, (std::vector<std::string>{"oldest is given up", "old is given up"}));
}

}  // namespace
}  // namespace tessera::server

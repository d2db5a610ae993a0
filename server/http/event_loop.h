#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <coroutine>
#include <cstdint>
#include <mutex>
#include <stop_token>

#include "server/store/file_descriptor.h"

namespace tessera::server {

class Channel;

/// Waits for sockets on one thread (epoll(7)) and resumes the coroutines that wait for them. Once it is made it
/// allocates nothing, so that it goes on where there is no memory left.
class EventLoop {
 public:
  /// Throws std::system_error when the system has no file descriptor left, say.
  EventLoop();
  /// Once `run` has returned: coroutines that still wait are destroyed.
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  /// Works until `stop` is called, which any thread may.
  void run() noexcept;
  void stop() noexcept;

  /// Gives up the connection whose peer has kept it waiting the longest, and for at least so long, without any getting
  /// on. Whether there was one; it ends before the next message is delivered. For the loop's thread.
  bool make_room(std::chrono::steady_clock::duration patience) noexcept;

  /// What another thread has to tell to a coroutine. Lives until `is_done` is seen by that coroutine.
  struct Message {
    Channel* to = nullptr;
    bool is_done = false;
    Message* next = nullptr;
  };
  /// Sets `message.is_done` on the loop's thread and resumes the coroutine that it goes to. For any thread.
  void post(Message& message) noexcept;

 private:
  friend class Channel;

  void wake() noexcept;
  void end_given_up() noexcept;
  void deliver_messages() noexcept;
  void resume_expired() noexcept;

  FileDescriptor epoll_, wake_;
  std::atomic<bool> stopped_{false};
  std::chrono::steady_clock::time_point looked_;  ///< At what has expired.
  /// Nothing expires before: so that thousands of connections that wait aren't looked at all the time.
  std::chrono::steady_clock::time_point earliest_ = std::chrono::steady_clock::time_point::max();
  Channel* channels_ = nullptr;  ///< All of them: a list through `next_`.
  Channel* given_up_ = nullptr;  ///< To be ended after the events at hand, which may be for it.
  std::mutex mutex_;             ///< Guards what follows.
  Message* messages_ = nullptr;  ///< The newest first.
};

/// A socket that a loop watches, and the one coroutine that works on it. Belongs to the loop's thread.
class Channel {
 public:
  using Clock = std::chrono::steady_clock;

  /// `coroutine` is the outermost one, which owns this. Throws std::system_error or std::bad_alloc when the socket
  /// can't be watched.
  Channel(EventLoop& loop, FileDescriptor socket, std::coroutine_handle<> coroutine);
  ~Channel();
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;

  int socket() const { return socket_.value(); }

  /// When waiting ends without anything having happened.
  void expires_after(Clock::duration time) { expires_at(Clock::now() + time); }
  void expires_at(Clock::time_point time) {
    deadline_ = time;
    loop_.earliest_ = std::min(loop_.earliest_, time);
  }
  void never_expires() { expires_at(Clock::time_point::max()); }

  /// `co_await channel.change()` waits until the socket may have become readable or writable, or a message comes;
  /// false when it is too late for that. Whoever awaits has tried before, and tries again: it says no more than "may".
  struct Change {
    Channel& channel;
    bool await_ready() const noexcept { return false; }
    void await_suspend(std::coroutine_handle<> waiting) const noexcept { channel.waiting_ = waiting; }
    bool await_resume() const noexcept { return !channel.has_expired_; }
  };
  Change change() { return {*this}; }

  /// To be called when the peer has got on with what it sends or reads, or has nothing to get on with.
  void got_on(Clock::time_point when = Clock::now()) { got_on_ = when; }
  /// The same wait as for `change`, for nothing but the peer: others may need the room more (`EventLoop::make_room`).
  struct PeerChange : Change {
    void await_suspend(std::coroutine_handle<> waiting) const noexcept {
      channel.waits_for_peer_ = true;
      Change::await_suspend(waiting);
    }
    bool await_resume() const noexcept {
      channel.waits_for_peer_ = false;
      return Change::await_resume();
    }
  };
  PeerChange change_by_peer() { return {{*this}}; }

  /// The peer has closed its side of the connection: it sends no more, but may still read.
  bool peer_has_finished() const { return peer_has_finished_; }
  /// Requested once the peer is known to read no more.
  std::stop_token broken() const { return broken_.get_token(); }
  /// What the peer has been sent can't be gone on with.
  void give_up() { broken_.request_stop(); }

 private:
  friend class EventLoop;

  void happened(std::uint32_t events) noexcept;
  void resume(bool expired) noexcept;

  EventLoop& loop_;
  FileDescriptor socket_;
  std::coroutine_handle<> coroutine_, waiting_;
  Clock::time_point deadline_ = Clock::time_point::max();
  Clock::time_point got_on_ = Clock::now();
  bool has_expired_ = false, peer_has_finished_ = false, waits_for_peer_ = false;
  std::stop_source broken_;
  Channel *previous_ = nullptr, *next_ = nullptr;
};

}  // namespace tessera::server

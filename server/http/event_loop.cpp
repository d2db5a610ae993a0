#include "server/http/event_loop.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include <sys/epoll.h>
#include <sys/eventfd.h>

namespace tessera::server {
namespace {

/// How exact deadlines are.
constexpr std::chrono::milliseconds kTick{50};

[[noreturn]] void fail(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

void watch(int epoll, int fd, std::uint32_t events, void* who) {
  epoll_event event{};
  event.events = events;
  event.data.ptr = who;
  if (::epoll_ctl(epoll, EPOLL_CTL_ADD, fd, &event) != 0) fail("cannot watch a socket");
}

}  // namespace

EventLoop::EventLoop() : epoll_(::epoll_create1(EPOLL_CLOEXEC)), wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (!epoll_ || !wake_) fail("cannot wait for sockets");
  watch(epoll_.value(), wake_.value(), EPOLLIN, nullptr);
}

EventLoop::~EventLoop() {
  while (channels_) channels_->coroutine_.destroy();
}

void EventLoop::run() noexcept {
  std::array<epoll_event, 64> events;
  while (!stopped_) {
    const int timeout = channels_ ? static_cast<int>(kTick.count()) : -1;
    const int count = ::epoll_wait(epoll_.value(), events.data(), events.size(), timeout);
    bool was_woken = false;
    for (int i = 0; i < count; ++i) {
      auto* channel = static_cast<Channel*>(events[static_cast<std::size_t>(i)].data.ptr);
      if (channel)
        channel->happened(events[static_cast<std::size_t>(i)].events);
      else
        was_woken = true;
    }
    end_given_up();
    if (was_woken) deliver_messages();  // After the events: what is told here may end channels that events were for.
    const auto now = Channel::Clock::now();
    if (now >= earliest_ && now - looked_ >= kTick) resume_expired();
  }
}

void EventLoop::stop() noexcept {
  stopped_ = true;
  wake();
}

bool EventLoop::make_room(std::chrono::steady_clock::duration patience) noexcept {
  if (given_up_) return true;
  Channel* longest = nullptr;
  for (Channel* channel = channels_; channel; channel = channel->next_)
    if (channel->waits_for_peer_ && (!longest || channel->got_on_ < longest->got_on_)) longest = channel;
  if (!longest || Channel::Clock::now() - longest->got_on_ < patience) return false;
  longest->give_up();
  given_up_ = longest;
  return true;
}

void EventLoop::end_given_up() noexcept {
  Channel* const channel = std::exchange(given_up_, nullptr);
  if (channel && channel->waits_for_peer_) channel->resume(true);
}

void EventLoop::wake() noexcept {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(wake_.value(), &one, sizeof one);  // Full is awake, too.
}

void EventLoop::post(Message& message) noexcept {
  {
    const std::lock_guard lock(mutex_);
    message.next = std::exchange(messages_, &message);
  }
  wake();
}

void EventLoop::deliver_messages() noexcept {
  std::uint64_t ignored;
  [[maybe_unused]] const auto size = ::read(wake_.value(), &ignored, sizeof ignored);
  Message* messages = nullptr;
  {
    const std::lock_guard lock(mutex_);
    messages = std::exchange(messages_, nullptr);
  }
  while (messages) {
    Message& message = *std::exchange(messages, messages->next);
    message.is_done = true;
    message.to->resume(false);
  }
}

void EventLoop::resume_expired() noexcept {
  looked_ = Channel::Clock::now();
  earliest_ = Channel::Clock::time_point::max();
  for (Channel* channel = channels_; channel;) {
    Channel& at_hand = *std::exchange(channel, channel->next_);
    earliest_ = std::min(earliest_, at_hand.deadline_);  // One that has passed counts until there is another.
    if (at_hand.deadline_ <= looked_) at_hand.resume(true);
  }
}

Channel::Channel(EventLoop& loop, FileDescriptor socket, std::coroutine_handle<> coroutine)
    : loop_(loop), socket_(std::move(socket)), coroutine_(coroutine) {
  watch(loop_.epoll_.value(), socket_.value(), EPOLLIN | EPOLLOUT | EPOLLRDHUP | EPOLLET, this);
  next_ = std::exchange(loop_.channels_, this);
  if (next_) next_->previous_ = this;
}

Channel::~Channel() {
  if (loop_.given_up_ == this) loop_.given_up_ = nullptr;
  // Closing isn't enough where the socket has been duplicated: events would still come, for what is gone.
  ::epoll_ctl(loop_.epoll_.value(), EPOLL_CTL_DEL, socket_.value(), nullptr);
  (previous_ ? previous_->next_ : loop_.channels_) = next_;
  if (next_) next_->previous_ = previous_;
}

void Channel::happened(std::uint32_t events) noexcept {
  if (events & (EPOLLRDHUP | EPOLLHUP | EPOLLERR)) peer_has_finished_ = true;
  if (events & (EPOLLHUP | EPOLLERR)) broken_.request_stop();
  resume(false);
}

void Channel::resume(bool expired) noexcept {
  has_expired_ = expired;
  if (const auto waiting = std::exchange(waiting_, nullptr)) waiting.resume();
}

}  // namespace tessera::server

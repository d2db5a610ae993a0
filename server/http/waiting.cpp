#include "server/http/waiting.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <string_view>

namespace tessera::server {
namespace {

using Clock = Channel::Clock;

/// A client that says no more is asked after so long whether it still listens.
constexpr std::chrono::milliseconds kBeforeAsking{250};
constexpr std::string_view kProcessing = "HTTP/1.1 102 Processing\r\n\r\n";

}  // namespace

// Temporaries with destructors are kept out of co_await expressions, as in session.cpp.

struct Waiting::ToldByJob final : JobTable::Waiter {
  ToldByJob(Waiting& its_waiting, const Later& its_later) : waiting(its_waiting), later(its_later) {
    message.to = &waiting.channel_;
  }
  void told() noexcept override { waiting.loop_.post(message); }

  Clock::time_point until() const { return later.until.value_or(Clock::time_point::max()); }

  /// Whether it is told no more: from then on there is no message.
  bool has_stopped() {
    const bool is_over = waiting.channel_.broken().stop_requested() || Clock::now() >= until();
    return is_over && waiting.jobs_.stop_waiting(later.job, *this);
  }

  Waiting& waiting;
  const Later& later;
  EventLoop::Message message;
};

Task<bool> Waiting::for_job(const Later& later, bool may_ask) {
  ToldByJob told(*this, later);
  const auto what = later.until_written ? JobTable::Until::written : JobTable::Until::ended;
  if (!jobs_.wait(later.job, told, what)) co_return true;
  co_await for_message(told.message, may_ask, &told);
  co_return true;
}

Task<bool> Waiting::for_message(const EventLoop::Message& message, bool may_ask, ToldByJob* by_job) {
  const auto until = by_job == nullptr ? Clock::time_point::max() : by_job->until();
  std::optional<Clock::time_point> to_ask;
  bool has_asked = false;
  while (!message.is_done && (by_job == nullptr || !by_job->has_stopped())) {
    if (channel_.peer_has_finished() && may_ask && !has_asked && !to_ask) to_ask = Clock::now() + kBeforeAsking;
    channel_.expires_at(to_ask ? std::min(*to_ask, until) : until);
    co_await channel_.change();
    if (message.is_done || !to_ask || Clock::now() < *to_ask) continue;
    to_ask.reset();
    has_asked = true;
    // A part of it would stand in the middle of what follows.
    if (!transport_.send_at_once(kProcessing)) channel_.give_up();
  }
  co_return true;
}

}  // namespace tessera::server

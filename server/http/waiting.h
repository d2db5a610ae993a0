#pragma once

#include "server/http/event_loop.h"
#include "server/http/lane.h"
#include "server/http/response.h"
#include "server/http/task.h"
#include "server/http/transport.h"
#include "server/jobs/job_table.h"

namespace tessera::server {

/// How a session's coroutine waits while others work for it, and looks whether its client still does.
///
/// A client that closes its side may have gone, or may just have no more to say, as `nc -N` does, and both look the
/// same from here until something is sent. So that it needn't be guessed, an interim response is (RFC 9110, 15.2):
/// who listens skips it, and for who has gone the system answers with a reset. HTTP/1.0 knows none, so that such a
/// client is worked for to the end.
class Waiting {
 public:
  Waiting(EventLoop& loop, Channel& channel, Transport& transport, JobTable& jobs)
      : loop_(loop), channel_(channel), transport_(transport), jobs_(jobs) {}

  /// Calls `function`, which doesn't throw, in a lane, unless the client has gone before.
  template <typename Function>
  Task<bool> for_work(Lane& lane, Function& function, bool may_ask) {
    struct InLane final : Lane::Work {
      InLane(Waiting& its_waiting, Function& its_function) : waiting(its_waiting), function(its_function) {}
      void run() noexcept override {
        if (!waiting.channel_.broken().stop_requested()) function();
        waiting.loop_.post(message);
      }
      Waiting& waiting;
      Function& function;
      EventLoop::Message message;
    };
    InLane in_lane(*this, function);
    in_lane.message.to = &channel_;
    lane.push(in_lane);
    co_await for_message(in_lane.message, may_ask);
    co_return true;
  }

  /// For what an answer waits for, or until the client has gone.
  Task<bool> for_job(const Later& later, bool may_ask);

 private:
  /// What a job tells when it has ended.
  struct ToldByJob;

  /// For a message, which a job sends where there is one: then no longer than an answer waits for it, nor for a client
  /// that has gone.
  Task<bool> for_message(const EventLoop::Message& message, bool may_ask, ToldByJob* by_job = nullptr);

  EventLoop& loop_;
  Channel& channel_;
  Transport& transport_;
  JobTable& jobs_;
};

}  // namespace tessera::server

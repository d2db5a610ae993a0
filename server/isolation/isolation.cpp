#include "server/isolation/isolation.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <optional>
#include <system_error>
#include <utility>

#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include "proto/wire/abandoned.h"

namespace tessera::server {
namespace {

using Clock = std::chrono::steady_clock;

bool order(int zygote, ZygoteHears what, const FileDescriptor& end) {
  const std::array files{end.value()};
  return send_message(zygote, static_cast<std::uint32_t>(what), {}, files);
}

int number_in(const Message& message) {
  int number = 0;
  std::memcpy(&number, message.body.data(), std::min(sizeof(number), message.body.size()));
  return number;
}

Isolation::Failure failure(int status) {
  using Kind = Isolation::Failure::Kind;
  if (!WIFSIGNALED(status)) return {Kind::crashed, "ended before it was done"};
  const int signal = WTERMSIG(status);
  if (signal == SIGXCPU) return {Kind::hung, "took too long"};
  if (signal == SIGKILL)
    return {Kind::killed, "was ended by the system or its administrator, perhaps for want of memory"};
  if (signal == SIGXFSZ) return {Kind::killed, "came to more than there may be"};
  return {Kind::crashed, std::string("crashed (") + ::sigabbrev_np(signal) + ')'};
}

/// The next message; nothing once `deadline` has come, or nobody is at the other end.
std::optional<Message> wait_for_message(int channel, Clock::time_point deadline, bool& is_late) {
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    is_late = left.count() <= 0;
    if (is_late) return std::nullopt;
    pollfd looked_at{channel, POLLIN, 0};
    const int ready = ::poll(&looked_at, 1, static_cast<int>(std::min<std::int64_t>(left.count(), 1 << 30)));
    if (ready > 0) return receive_message(channel);
  }
}

}  // namespace

Isolation::Isolation(Work work, std::function<void()> prepare)
    : work_(std::move(work)), prepare_(std::move(prepare)), bare_(start_zygote(work_, prepare_)) {}

Isolation::~Isolation() {
  for (FileDescriptor& spare : spares_) spare = FileDescriptor();
  prepared_ = FileDescriptor();
  bare_.control = FileDescriptor();
  ::waitpid(bare_.process, nullptr, 0);
}

FileDescriptor Isolation::worker(Preparation preparation) const {
  FileDescriptor spare;
  {
    const std::lock_guard lock(mutex_);
    spare = std::exchange(spares_[static_cast<std::size_t>(preparation)], FileDescriptor());
  }
  pollfd looked_at{spare.value(), POLLIN, 0};
  if (spare && ::poll(&looked_at, 1, 0) == 0) return spare;  // And hasn't ended.
  return new_worker(preparation);
}

/// For the next request, which then needn't wait until there is one.
void Isolation::provide_spare(Preparation preparation) const {
  try {
    FileDescriptor spare = new_worker(preparation);
    const std::lock_guard lock(mutex_);
    if (FileDescriptor& kept = spares_[static_cast<std::size_t>(preparation)]; !kept) kept = std::move(spare);
  } catch (const NoWorker&) {  // Then the next request says so.
  }
}

FileDescriptor Isolation::new_worker(Preparation preparation) const try {
  auto [ours, its] = make_channel();
  if (preparation == Preparation::bare) {
    if (!order(bare_.control.value(), ZygoteHears::make_worker, its)) throw NoWorker(problem());
    return std::move(ours);
  }
  const std::lock_guard lock(mutex_);
  for (int tries = 0; tries < 2; ++tries) {
    if (prepared_ && order(prepared_.value(), ZygoteHears::make_worker, its)) return std::move(ours);
    auto [control, told] = make_channel();  // The first one, or the last one has ended.
    if (!order(bare_.control.value(), ZygoteHears::make_zygote, told)) break;
    prepared_ = std::move(control);
  }
  throw NoWorker(problem());
} catch (const std::system_error& error) {
  throw NoWorker(error.what());
}

std::variant<std::string, Isolation::Failure> Isolation::run(const Request& request, const std::stop_token& stop,
                                                             const AnswerTo& answer) const {
  try {
    return run_once(request, stop, answer);
  } catch (const NoWorker&) {  // A spare one may have gone with the zygote that made it.
    return run_once(request, stop, answer);
  }
}

std::variant<std::string, Isolation::Failure> Isolation::run_once(const Request& request, const std::stop_token& stop,
                                                                  const AnswerTo& answer) const {
  proto::throw_if_abandoned(stop);
  const FileDescriptor channel = worker(request.preparation);
  const std::stop_callback hang_up(stop, [&] { ::shutdown(channel.value(), SHUT_RDWR); });
  send_message(channel.value(), 0, request.body, request.files);
  auto deadline = Clock::now() + request.patience;
  for (;;) {
    bool is_late = false;
    const std::optional<Message> said = wait_for_message(channel.value(), deadline, is_late);
    proto::throw_if_abandoned(stop);
    if (is_late) return Failure{Failure::Kind::hung, "took too long"};
    if (!said) throw NoWorker("the process that made it has ended");
    switch (static_cast<WorkerSays>(said->kind)) {
      case WorkerSays::asks: {
        const auto begun = Clock::now();
        const Answer answered = answer ? answer(said->body) : Answer{};
        send_message(channel.value(), 0, answered.body, answered.files);
        deadline += Clock::now() - begun;
        break;
      }
      case WorkerSays::done:
        provide_spare(request.preparation);  // Now, as making it takes processors from who works.
        return said->body;
      case WorkerSays::ended:
        return failure(number_in(*said));
      case WorkerSays::none:
        throw NoWorker(std::generic_category().message(number_in(*said)));
    }
  }
}

std::string Isolation::problem() const {
  pollfd looked_at{bare_.control.value(), 0, 0};
  if (::poll(&looked_at, 1, 0) <= 0 || (looked_at.revents & (POLLHUP | POLLERR)) == 0) return "";
  return "the process that makes others has ended; restart the server";
}

}  // namespace tessera::server

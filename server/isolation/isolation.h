#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "server/isolation/worker.h"
#include "server/isolation/zygote.h"
#include "server/store/file_descriptor.h"

namespace tessera::server {

/// There is no process to be had for a request.
class NoWorker : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Processes for work with what strangers sent: one for each request, which may crash, hang or be taken over without
/// harm to this one. Safe to use from any number of threads.
class Isolation {
 public:
  /// Starts what makes them. `prepare` is what is done for processes that are to be prepared, before they are made and
  /// once more in each of them, which then has what that takes at hand.
  /// Precondition: this process has one thread. Throws std::system_error.
  Isolation(Work work, std::function<void()> prepare);
  Isolation(const Isolation&) = delete;
  Isolation& operator=(const Isolation&) = delete;
  ~Isolation();

  enum class Preparation { bare, prepared };

  /// A request, to a process that is made for it.
  struct Request {
    Preparation preparation = Preparation::bare;
    std::string_view body;
    std::span<const int> files;
    std::chrono::milliseconds patience{0};  ///< With the worker, not counting what `answer` takes.
  };

  /// Why there is no answer: in words that go on from "The process that read it".
  struct Failure {
    enum class Kind { crashed, hung, killed } kind;
    std::string how;
  };

  /// Answers a worker's question, which may be asked again of another one; files stay the caller's.
  struct Answer {
    std::string body;
    std::vector<int> files;
  };
  using AnswerTo = std::function<Answer(std::string_view question)>;

  /// What the worker says when it is done. Throws `Abandoned` when `stop` is requested, `NoWorker`, and what `answer`
  /// throws; the worker is ended then.
  std::variant<std::string, Failure> run(const Request& request, const std::stop_token& stop,
                                         const AnswerTo& answer = {}) const;

  /// Why there can't be workers; empty where there can.
  std::string problem() const;

 private:
  std::variant<std::string, Failure> run_once(const Request& request, const std::stop_token& stop,
                                              const AnswerTo& answer) const;
  FileDescriptor worker(Preparation preparation) const;
  FileDescriptor new_worker(Preparation preparation) const;
  void provide_spare(Preparation preparation) const;

  const Work work_;
  const std::function<void()> prepare_;
  ZygoteProcess bare_;
  mutable std::mutex mutex_;  ///< Guards what follows.
  mutable FileDescriptor prepared_;
  mutable std::array<FileDescriptor, 2> spares_;  ///< By their preparation: workers that wait for requests.
};

}  // namespace tessera::server

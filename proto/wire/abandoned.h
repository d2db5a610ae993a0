#pragma once

#include <cstdint>
#include <exception>
#include <stop_token>
#include <utility>

namespace tessera::proto {

/// Thrown where a stop is requested while a document or a file is read: nobody wants the result any more. The one
/// exception that leaves `parse_scene`, `parse_job` and `import_file`.
class Abandoned : public std::exception {
 public:
  const char* what() const noexcept override { return "Reading was abandoned"; }
};

inline void throw_if_abandoned(const std::stop_token& stop) {
  if (stop.stop_requested()) throw Abandoned();
}

/// Counts the steps of something that may take long, each a microsecond at most, and looks every some thousand of
/// them whether it is still wanted: throws `Abandoned` when it isn't. One thread at a time.
class Steps {
 public:
  explicit Steps(std::stop_token stop = {}) : stop_(std::move(stop)) {}

  void take(std::uint64_t steps = 1) {
    taken_ += steps;
    if (taken_ < next_look_) return;
    next_look_ = taken_ + kBetweenLooks;
    throw_if_abandoned(stop_);
  }

  std::uint64_t taken() const { return taken_; }
  const std::stop_token& stop() const { return stop_; }

 private:
  static constexpr std::uint64_t kBetweenLooks = 4096;

  std::stop_token stop_;
  std::uint64_t taken_ = 0, next_look_ = 0;
};

}  // namespace tessera::proto

#pragma once

#include <exception>
#include <stop_token>
#include <utility>

namespace tessera {

/// Thrown where a structure is built that nobody wants any more.
class BuildStopped : public std::exception {
 public:
  const char* what() const noexcept override { return "Building was stopped"; }
};

/// As long as it lives, structures that are built by the thread that made it, and by others for that one, are wanted
/// until `stop` is requested. Building then ends soon, with `BuildStopped`; what was being built is gone. Of several
/// the last one counts.
class BuildStop {
 public:
  explicit BuildStop(std::stop_token stop) : stop_(std::move(stop)), outer_(std::exchange(current_, this)) {}
  ~BuildStop() { current_ = outer_; }
  BuildStop(const BuildStop&) = delete;

  /// Throws `BuildStopped` if that is so. To be called by builders every so many items.
  static void check() {
    if (current_ && current_->stop_.stop_requested()) throw BuildStopped();
  }

  /// For threads that help this one.
  static std::stop_token current() { return current_ ? current_->stop_ : std::stop_token(); }

 private:
  static inline thread_local const BuildStop* current_ = nullptr;

  const std::stop_token stop_;
  const BuildStop* const outer_;
};

}  // namespace tessera

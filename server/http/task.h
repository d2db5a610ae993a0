#pragma once

#include <coroutine>
#include <exception>
#include <optional>
#include <utility>

namespace tessera::server {

/// A coroutine that begins when it is awaited, and hands its result, or what it threw, to the coroutine that awaits it.
/// All of them are resumed on one thread, that of an `EventLoop`. Making one throws std::bad_alloc; nothing else does.
template <typename T>
class [[nodiscard]] Task {
 public:
  struct promise_type;
  using Handle = std::coroutine_handle<promise_type>;

  /// Goes on with who awaits, unless that one is still in the call that began this.
  struct Finish {
    bool await_ready() const noexcept { return false; }
    void await_suspend(Handle finished) const noexcept {
      if (const auto awaiting = finished.promise().awaiting) awaiting.resume();
    }
    void await_resume() const noexcept {}
  };

  struct promise_type {
    Task get_return_object() { return Task(Handle::from_promise(*this)); }
    std::suspend_always initial_suspend() const noexcept { return {}; }
    Finish final_suspend() const noexcept { return {}; }
    void return_value(T value) { result = std::move(value); }
    void unhandled_exception() noexcept { error = std::current_exception(); }

    std::coroutine_handle<> awaiting;
    std::optional<T> result;
    std::exception_ptr error;
  };

  Task(Task&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Task& operator=(Task&&) = delete;
  ~Task() {
    if (handle_) handle_.destroy();
  }

  bool await_ready() const noexcept { return false; }
  /// Many tasks that needn't wait, one after the other, don't pile up on the stack.
  bool await_suspend(std::coroutine_handle<> awaiting) {
    handle_.resume();
    if (handle_.done()) return false;
    handle_.promise().awaiting = awaiting;
    return true;
  }
  T await_resume() {
    if (handle_.promise().error) std::rethrow_exception(handle_.promise().error);
    return *std::move(handle_.promise().result);
  }

 private:
  explicit Task(Handle handle) : handle_(handle) {}

  Handle handle_;
};

/// A coroutine that nobody awaits: it begins with `handle.resume()`, lets no exception out once it has waited, and is
/// gone at its end.
struct Detached {
  struct promise_type {
    Detached get_return_object() { return {std::coroutine_handle<promise_type>::from_promise(*this)}; }
    std::suspend_always initial_suspend() const noexcept { return {}; }
    std::suspend_never final_suspend() const noexcept { return {}; }
    void return_void() const noexcept {}
    void unhandled_exception() const { throw; }
  };
  std::coroutine_handle<> handle;
};

/// `co_await ThisCoroutine{}` is the handle of the coroutine that asks.
struct ThisCoroutine {
  std::coroutine_handle<> handle;

  bool await_ready() const noexcept { return false; }
  bool await_suspend(std::coroutine_handle<> asking) noexcept {
    handle = asking;
    return false;
  }
  std::coroutine_handle<> await_resume() const noexcept { return handle; }
};

}  // namespace tessera::server

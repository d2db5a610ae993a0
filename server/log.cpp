#include "server/log.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <new>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <poll.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

namespace tessera::server {
namespace {

constexpr std::size_t kBufferBytes = 256 << 10;
/// A pipe that has room at all takes as much without blocking (PIPE_BUF, pipe(7)).
constexpr std::size_t kPieceBytes = 4096;
constexpr std::chrono::milliseconds kLookAgain{50};
constexpr std::chrono::seconds kPatience{1};  ///< At the end.

std::atomic<std::uint64_t> dropped{0};
std::atomic<LogFormat> format_now{LogFormat::text};
std::atomic<LogSink*> access_sink{nullptr};  ///< Where it goes, if it is on.

// Of the line that this thread logs.
thread_local std::string_view request_at_hand;
thread_local std::span<const LogField> fields_at_hand;

/// Writes what spdlog is told, with what the thread that tells it has at hand.
class LineFormatter final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) override {
    const auto level = spdlog::level::to_string_view(message.level);
    const auto write = [&](std::span<const LogField> fields) {
      write_log_line(format_now, message.time, {level.data(), level.size()},
                     {message.payload.data(), message.payload.size()}, fields, out);
    };
    const std::array request{LogField{"request_id", request_at_hand}};
    if (message.logger_name.size() == 0)
      write({});  // The log's own, whatever the thread is about.
    else if (!fields_at_hand.empty())
      write(fields_at_hand);
    else
      write(std::span(request).first(request_at_hand.empty() ? 0 : 1));
  }
  std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<LineFormatter>(); }
};

}  // namespace

RequestScope::RequestScope(std::string_view id) : before_(std::exchange(request_at_hand, id)) {}
RequestScope::~RequestScope() { request_at_hand = before_; }

class LogSink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  LogSink() : buffer_(kBufferBytes), writer_([this] { write_lines(); }) {}
  ~LogSink() override { close(); }

  void close() {
    {
      const std::lock_guard lock(mutex_);
      if (closing_) return;
      closed_at_ = std::chrono::steady_clock::now();
      closing_ = true;
    }
    changed_.notify_one();
    writer_.join();
  }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    if (!tell_dropped() || closing_ || !push(message)) ++dropped;
    changed_.notify_one();
  }
  void flush_() override {}

 private:
  /// False when there is no room for it.
  bool push(const spdlog::details::log_msg& message) try {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    if (line.size() > buffer_.size() - used_) return false;
    for (const char c : line) buffer_[(begin_ + used_++) % buffer_.size()] = c;
    return true;
  } catch (const std::bad_alloc&) {
    return false;
  }

  /// Says in the log what it lacks up to here; false while there is no room for that.
  bool tell_dropped() {
    const std::uint64_t now = dropped;
    if (now == told_) return true;
    char text[64];
    const int size = std::snprintf(text, sizeof text, "%llu lines of the log were dropped here: nobody read it",
                                   static_cast<unsigned long long>(now - told_));
    if (!push({"", spdlog::level::warn, {text, static_cast<std::size_t>(size)}})) return false;
    told_ = now;
    return true;
  }

  void write_lines() {
    std::array<char, kPieceBytes> piece;
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return used_ > 0 || told_ != dropped || closing_; });
      if (used_ == 0 && !tell_dropped()) told_ = dropped;  // There is no memory to tell it.
      if (used_ == 0 && closing_) return;
      if (used_ == 0) continue;
      const std::size_t size = std::min(used_, piece.size());
      for (std::size_t i = 0; i < size; ++i) piece[i] = buffer_[(begin_ + i) % buffer_.size()];
      begin_ = (begin_ + size) % buffer_.size();
      used_ -= size;
      lock.unlock();
      const bool written = write_out({piece.data(), size});
      lock.lock();
      if (written) continue;
      if (closing_) {  // Nor will anybody read the rest.
        for (; used_ > 0; --used_, begin_ = (begin_ + 1) % buffer_.size()) dropped += buffer_[begin_] == '\n' ? 1 : 0;
      }
      dropped += static_cast<std::uint64_t>(std::count(piece.begin(), piece.begin() + size, '\n'));
      told_ = dropped;  // There is nobody to tell it to.
    }
  }

  /// False when nobody will read it.
  bool write_out(std::string_view bytes) const {
    while (!bytes.empty()) {
      pollfd stderr_is{STDERR_FILENO, POLLOUT, 0};
      if (::poll(&stderr_is, 1, kLookAgain.count()) <= 0) {
        if (closing_ && std::chrono::steady_clock::now() - closed_at_ > kPatience) return false;
        continue;
      }
      const ssize_t written = ::write(STDERR_FILENO, bytes.data(), bytes.size());
      if (written >= 0)
        bytes.remove_prefix(static_cast<std::size_t>(written));
      else if (errno != EINTR && errno != EAGAIN)
        return false;
    }
    return true;
  }

  // All guarded by the base's `mutex_`, which nothing else is locked under, but for what is atomic.
  std::vector<char> buffer_;  ///< A ring.
  std::size_t begin_ = 0, used_ = 0;
  std::uint64_t told_ = 0;  ///< Of the lines dropped.
  std::atomic<bool> closing_{false};
  std::chrono::steady_clock::time_point closed_at_;
  std::condition_variable changed_;
  std::thread writer_;
};

Log::Log(const LogSettings& settings) : sink_(std::make_shared<LogSink>()) {
  sink_->set_formatter(std::make_unique<LineFormatter>());
  auto logger = std::make_shared<spdlog::logger>("tesserad", sink_);
  logger->set_error_handler([](const std::string&) { ++dropped; });  // A line that there was no memory for.
  spdlog::set_default_logger(std::move(logger));
  set(settings);
}

void Log::set(const LogSettings& settings) {
  spdlog::set_level(spdlog::level::from_str(settings.level));
  format_now = settings.format;
  access_sink = settings.access ? sink_.get() : nullptr;
}

bool is_access_logged() noexcept { return access_sink != nullptr; }

void log_access(std::span<const LogField> fields) noexcept {
  LogSink* const sink = access_sink;
  if (!sink) return;
  fields_at_hand = fields;
  sink->log({"access", spdlog::level::info, "access"});
  fields_at_hand = {};
}

Log::~Log() { close(); }

std::uint64_t Log::lines_dropped() { return dropped; }

void Log::close() {
  access_sink = nullptr;
  sink_->close();
}

}  // namespace tessera::server

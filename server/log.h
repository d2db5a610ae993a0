#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "server/log_line.h"

namespace tessera::server {

class LogSink;

/// What can be set about the log, at any time.
struct LogSettings {
  std::string level;  ///< A name of spdlog's: "info".
  LogFormat format;
  bool access;  ///< A line for each request when it has been answered, whatever the level.
};

/// While one lives, what its thread logs carries the id of the request that it works for. Not to live across a
/// co_await. `id` outlives it.
class RequestScope {
 public:
  explicit RequestScope(std::string_view id);
  ~RequestScope();
  RequestScope(const RequestScope&) = delete;
  RequestScope& operator=(const RequestScope&) = delete;

 private:
  std::string_view before_;
};

/// A line of the access log, if that is on: "access" with these fields. For any thread; never throws.
void log_access(std::span<const LogField> fields) noexcept;
bool is_access_logged() noexcept;

/// The log, on stderr, for as long as this lives; the one of spdlog's functions. Lines go into a buffer of limited size
/// that a thread of its own writes, so that who logs never waits for who reads: where nobody does, lines are dropped,
/// counted, and told of when they can be. Never throws std::bad_alloc at who logs.
class Log {
 public:
  /// Throws std::system_error when there can't be a thread.
  explicit Log(const LogSettings& settings);
  ~Log();
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  /// For any thread.
  void set(const LogSettings& settings);

  /// Lines that were dropped since the start. For any thread.
  static std::uint64_t lines_dropped();

  /// Waits until what was logged is written, or nobody reads for a second. Lines that come later are dropped.
  void close();

 private:
  std::shared_ptr<LogSink> sink_;
};

}  // namespace tessera::server

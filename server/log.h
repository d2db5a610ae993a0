#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace tessera::server {

class LogSink;

/// The log, on stderr, for as long as this lives; the one of spdlog's functions. Lines go into a buffer of limited size
/// that a thread of its own writes, so that who logs never waits for who reads: where nobody does, lines are dropped,
/// counted, and told of when they can be. Never throws std::bad_alloc at who logs.
class Log {
 public:
  /// Throws std::system_error when there can't be a thread.
  explicit Log(const std::string& level);
  ~Log();
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  /// Lines that were dropped since the start. For any thread.
  static std::uint64_t lines_dropped();

  /// Waits until what was logged is written, or nobody reads for a second. Lines that come later are dropped.
  void close();

 private:
  std::shared_ptr<LogSink> sink_;
};

}  // namespace tessera::server

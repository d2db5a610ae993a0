#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string_view>
#include <variant>

#include <spdlog/common.h>

namespace tessera::server {

enum class LogFormat { text, json };

/// What a line tells beside its message.
struct LogField {
  std::string_view name;
  std::variant<std::string_view, std::uint64_t, double> value;
};

/// Appends a line of the log, with its end. As text: "2026-11-30T12:00:00.000Z info message name=value", values in
/// quotes where they have to be. As JSON: an object with `ts`, `level`, `message` and the fields. Whatever message and
/// values hold, it is one line of valid UTF-8 and nothing in it acts on a terminal (`proto::printable`). Throws
/// std::bad_alloc.
void write_log_line(LogFormat format, std::chrono::system_clock::time_point time, std::string_view level,
                    std::string_view message, std::span<const LogField> fields, spdlog::memory_buf_t& out);

}  // namespace tessera::server

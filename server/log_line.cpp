#include "server/log_line.h"

#include <cstdio>
#include <ctime>
#include <string>

#include "proto/wire/printable.h"

namespace tessera::server {
namespace {

void append(spdlog::memory_buf_t& out, std::string_view text) { out.append(text.data(), text.data() + text.size()); }

/// RFC 3339, UTC, milliseconds.
void append_time(spdlog::memory_buf_t& out, std::chrono::system_clock::time_point time) {
  const auto since_epoch = std::chrono::floor<std::chrono::milliseconds>(time.time_since_epoch()).count();
  const std::time_t seconds = since_epoch / 1000;
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char day_and_time[32], text[48];
  std::strftime(day_and_time, sizeof day_and_time, "%Y-%m-%dT%H:%M:%S", &parts);
  std::snprintf(text, sizeof text, "%s.%03dZ", day_and_time, static_cast<int>(since_epoch % 1000));
  append(out, text);
}

/// `printable` has taken out all else that JSON, or a reader of quoted words, can't have in a string.
void append_quoted(spdlog::memory_buf_t& out, std::string_view printable) {
  out.push_back('"');
  for (const char c : printable) {
    if (c == '"' || c == '\\') out.push_back('\\');
    out.push_back(c);
  }
  out.push_back('"');
}

void append_number(spdlog::memory_buf_t& out, const LogField& field) {
  char text[32];
  if (const auto* whole = std::get_if<std::uint64_t>(&field.value))
    std::snprintf(text, sizeof text, "%llu", static_cast<unsigned long long>(*whole));
  else
    std::snprintf(text, sizeof text, "%.6f", std::get<double>(field.value));
  append(out, text);
}

void append_value(spdlog::memory_buf_t& out, const LogField& field, bool always_quoted) {
  const auto* text = std::get_if<std::string_view>(&field.value);
  if (!text) return append_number(out, field);
  const std::string value = proto::printable(*text);
  if (always_quoted || value.empty() || value.find_first_of(" \"\\=") != std::string::npos)
    append_quoted(out, value);
  else
    append(out, value);
}

}  // namespace

void write_log_line(LogFormat format, std::chrono::system_clock::time_point time, std::string_view level,
                    std::string_view message, std::span<const LogField> fields, spdlog::memory_buf_t& out) {
  const bool is_json = format == LogFormat::json;
  append(out, is_json ? R"({"ts":")" : "");
  append_time(out, time);
  append(out, is_json ? R"(","level":")" : " ");
  append(out, level);
  append(out, is_json ? R"(","message":)" : " ");
  if (is_json)
    append_quoted(out, proto::printable(message));
  else
    append(out, proto::printable(message));
  for (const LogField& field : fields) {
    append(out, is_json ? ",\"" : " ");
    append(out, field.name);
    append(out, is_json ? "\":" : "=");
    append_value(out, field, is_json);
  }
  append(out, is_json ? "}\n" : "\n");
}

}  // namespace tessera::server

#include "server/log_line.h"

#include <cstdio>
#include <string>

#include "proto/wire/printable.h"
#include "server/rfc3339.h"

namespace tessera::server {
namespace {

void append(spdlog::memory_buf_t& out, std::string_view text) { out.append(text.data(), text.data() + text.size()); }

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
  append(out, rfc3339(time));
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

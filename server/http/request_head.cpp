#include "server/http/request_head.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <utility>

#include "server/http/http_syntax.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

namespace {

/// Some clients end a body with a line end too many; a server ignores it (RFC 9112, 2.2).
constexpr std::size_t kMostEmptyLines = 4;

Problem malformed(std::string detail) { return {ProblemCode::malformed_request, std::move(detail), {}}; }

/// Calls `item` for each part of a comma-separated list, without the space around it; empty ones are none.
template <typename Item>
void for_each_item(std::string_view list, Item item) {
  while (!list.empty()) {
    const std::size_t comma = std::min(list.find(','), list.size());
    if (const std::string_view text = trimmed(list.substr(0, comma)); !text.empty()) item(text);
    list.remove_prefix(std::min(comma + 1, list.size()));
  }
}

/// RFC 9110, 8.6: digits, however many. A repeated length, even the same one, is what attacks look like, and may be
/// refused.
std::optional<std::uint64_t> read_length(std::string_view text) {
  std::uint64_t length = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), length);
  if (text.empty() || end != text.data() + text.size() || error == std::errc::invalid_argument) return std::nullopt;
  return error == std::errc() ? length : std::numeric_limits<std::uint64_t>::max();
}

}  // namespace

std::optional<Problem> RequestHeadParser::advance(std::string_view received) {
  while (!is_complete_) {
    const std::size_t limit = has_request_line_ ? headers_begin_ + kMostHeaders : line_begin_ + kMostRequestLine;
    const std::size_t newline = received.find('\n', seen_);
    if (std::min(newline, received.size()) >= limit) {
      if (has_request_line_)
        return Problem{ProblemCode::headers_too_large,
                       "The headers exceed " + std::to_string(kMostHeaders) + " bytes together.",
                       {}};
      if (received.substr(line_begin_).find(' ') == std::string_view::npos)
        return Problem{ProblemCode::not_implemented, "There is no method with so long a name.", {}};
      return Problem{
          ProblemCode::target_too_long, "The request line exceeds " + std::to_string(kMostRequestLine) + " bytes.", {}};
    }
    if (newline == std::string_view::npos) {
      const std::string_view partial = received.substr(line_begin_);
      has_begun_ |= !partial.empty() && partial != "\r";
      // The end of a line may be yet to come after a CR; any other CR, or control, will never be right.
      const std::string_view settled = partial.ends_with('\r') ? partial.substr(0, partial.size() - 1) : partial;
      if (!is_field_value(settled)) return malformed("A line holds a control character.");
      seen_ = received.size();
      return std::nullopt;
    }
    std::string_view line = received.substr(line_begin_, newline - line_begin_);
    if (!line.ends_with('\r')) return malformed("A line ends in LF without CR.");
    line.remove_suffix(1);
    seen_ = line_begin_ = newline + 1;
    std::optional<Problem> wrong;
    if (!has_request_line_ && line.empty()) {
      if (++empty_lines_ > kMostEmptyLines) wrong = malformed("There are too many empty lines before the request.");
    } else if (!has_request_line_) {
      has_begun_ = has_request_line_ = true;
      headers_begin_ = line_begin_;
      wrong = read_request_line(line);
    } else if (!line.empty()) {
      wrong = read_header(line);
    } else {
      is_complete_ = true;
      wrong = conclude();
    }
    if (wrong) return wrong;
  }
  return std::nullopt;
}

std::optional<Problem> RequestHeadParser::read_request_line(std::string_view line) {
  const std::size_t first = line.find(' '), last = line.rfind(' ');
  if (first == std::string_view::npos || first == last)
    return malformed("A request begins with a method, a target and the version of HTTP, a space between each.");
  const std::string_view method = line.substr(0, first), version = line.substr(last + 1);
  const std::string_view target = line.substr(first + 1, last - first - 1);
  if (!is_token(method)) return malformed("The method isn't a token.");
  head_.method = method;
  head_.target = target;
  constexpr std::string_view kName = "HTTP/";
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  if (version.size() != 8 || !version.starts_with(kName) || version[6] != '.' || !is_digit(version[5]) ||
      !is_digit(version[7]))
    return malformed("The request line doesn't end in the version of HTTP.");
  if (version[5] != '1')
    return Problem{ProblemCode::version_not_supported, "This server speaks HTTP/1.1 and HTTP/1.0.", {}};
  head_.minor_version = std::min(version[7] - '0', 1);
  if (target.empty() || target.find(' ') != std::string_view::npos || !is_field_value(target))
    return malformed("The request target holds a space or a control character; write it as %20, say.");
  return std::nullopt;
}

std::optional<Problem> RequestHeadParser::read_header(std::string_view line) {
  if (++header_lines_ > kMostHeaderLines)
    return Problem{
        ProblemCode::headers_too_large, "There are more than " + std::to_string(kMostHeaderLines) + " headers.", {}};
  // A line that begins with a space would continue the one before; nobody may send that (RFC 9112, 5.2).
  if (!is_field_line(line))
    return malformed("A header is a name, a colon right after it, and a value without control characters.");
  const std::size_t colon = line.find(':');
  std::string name(line.substr(0, colon));
  std::ranges::transform(name, name.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c; });
  const std::string_view value = trimmed(line.substr(colon + 1));
  if (name == "host") ++host_lines_;
  const auto [entry, is_first] = head_.headers.try_emplace(std::move(name), value);
  if (!is_first) entry->second.append(", ").append(value);
  return std::nullopt;
}

std::optional<Problem> RequestHeadParser::conclude() {
  const auto value_of = [this](const char* name) -> std::optional<std::string_view> {
    const auto found = head_.headers.find(name);
    if (found == head_.headers.end()) return std::nullopt;
    return found->second;
  };
  const bool is_1_0 = head_.minor_version == 0;
  if (host_lines_ > 1 || (host_lines_ == 0 && !is_1_0)) return malformed("An HTTP/1.1 request has one Host header.");
  if (!is_host(value_of("host").value_or("")))
    return malformed("The Host header isn't one host, with or without a port.");

  const auto encoding = value_of("transfer-encoding"), length = value_of("content-length");
  if (encoding) {
    if (length) return malformed("Send either Content-Length or Transfer-Encoding, not both.");
    if (is_1_0) return malformed("HTTP/1.0 has no Transfer-Encoding.");
    std::string_view last;
    std::size_t codings = 0, chunked = 0;
    for_each_item(*encoding, [&](std::string_view coding) {
      last = coding;
      ++codings;
      if (equal_but_for_case(coding, "chunked")) ++chunked;
    });
    if (chunked != 1 || !equal_but_for_case(last, "chunked"))
      return malformed("A Transfer-Encoding ends in chunked, once.");
    if (codings > 1)
      return Problem{ProblemCode::not_implemented, "The only Transfer-Encoding known here is chunked.", {}};
    head_.is_chunked = true;
  }
  if (length) {
    const auto bytes = read_length(*length);
    if (!bytes) return malformed("Content-Length is one number.");
    head_.content_length = *bytes;
  }

  head_.keep_alive = !is_1_0;
  bool closes = false;
  for_each_item(value_of("connection").value_or(""), [&](std::string_view option) {
    if (equal_but_for_case(option, "close")) closes = true;
    if (equal_but_for_case(option, "keep-alive")) head_.keep_alive = true;
  });
  if (closes) head_.keep_alive = false;

  if (const auto expected = value_of("expect"); expected && !is_1_0) {  // HTTP/1.0 has no expectations.
    if (!equal_but_for_case(*expected, "100-continue"))
      return Problem{ProblemCode::expectation_failed, "The only Expect known here is 100-continue.", {}};
    head_.expects_continue = true;
  }
  return std::nullopt;
}

}  // namespace tessera::server

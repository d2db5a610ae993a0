#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "proto/wire/problem.h"

namespace tessera::server {

/// What stands before the body of an HTTP/1 request (RFC 9112), checked.
struct RequestHead {
  std::string method;
  std::string target;  ///< As sent.
  /// Of HTTP/1. A later one than 1.1 counts as that (RFC 9110, 2.5).
  int minor_version = 1;
  std::map<std::string, std::string> headers;  ///< Names in lower case; repeated ones joined by ", ".
  bool keep_alive = true;
  bool expects_continue = false;
  bool is_chunked = false;
  std::uint64_t content_length = 0;  ///< 0 where nothing is said of a body; 2⁶⁴−1 stands for more, too.

  bool has_body() const { return is_chunked || content_length > 0; }
};

/// Reads the head of a request while it comes in, and refuses it as soon as something of it is wrong.
class RequestHeadParser {
 public:
  static constexpr std::size_t kMostRequestLine = 8 << 10;
  static constexpr std::size_t kMostHeaders = 16 << 10;  ///< In bytes, all lines.
  static constexpr std::size_t kMostHeaderLines = 100;
  /// No head is longer than this.
  static constexpr std::size_t kMostBytes = kMostRequestLine + kMostHeaders + 16;

  /// Looks at what there is of the head by now: what the last call was given, and more after it. A problem ends it.
  std::optional<proto::Problem> advance(std::string_view received);

  bool is_complete() const { return is_complete_; }
  /// Of the complete head. What follows in the bytes received isn't its own.
  std::size_t size() const { return line_begin_; }
  /// Whether anything of a request has come, empty lines before it aside.
  bool has_begun() const { return has_begun_; }

  /// Of a head that isn't complete, as much as is known.
  const RequestHead& head() const { return head_; }
  RequestHead take_head() { return std::move(head_); }

 private:
  std::optional<proto::Problem> read_request_line(std::string_view line);
  std::optional<proto::Problem> read_header(std::string_view line);
  /// What the headers say together.
  std::optional<proto::Problem> conclude();

  std::size_t line_begin_ = 0;  ///< Of the line that is still incomplete.
  std::size_t seen_ = 0;        ///< Bytes that hold no end of that line.
  std::size_t headers_begin_ = 0;
  std::size_t header_lines_ = 0, host_lines_ = 0, empty_lines_ = 0;
  bool has_begun_ = false, has_request_line_ = false, is_complete_ = false;
  RequestHead head_;
};

}  // namespace tessera::server

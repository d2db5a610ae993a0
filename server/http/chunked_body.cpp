#include "server/http/chunked_body.h"

#include <algorithm>
#include <charconv>

#include "server/http/http_syntax.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;

namespace {

/// Zeros may stand before a size, but not without end.
constexpr std::size_t kMostSizeDigits = 16;

Problem malformed(const char* detail) { return {ProblemCode::malformed_request, detail, {}}; }

/// Takes a token or a quoted string off the front.
bool take_value(std::string_view& text) {
  if (!text.starts_with('"')) {
    const std::size_t end = std::min(text.find_first_of(" \t;="), text.size());
    const bool good = is_token(text.substr(0, end));
    text.remove_prefix(end);
    return good;
  }
  for (std::size_t i = 1; i < text.size(); ++i) {
    if (text[i] == '\\') {
      ++i;
    } else if (text[i] == '"') {
      text.remove_prefix(i + 1);
      return true;
    }
  }
  return false;
}

/// Names, some with values, a semicolon before each (RFC 9112, 7.1.1).
bool are_extensions(std::string_view text) {
  const auto skip_space = [&text] { text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size())); };
  if (!is_field_value(text) || text.ends_with(' ') || text.ends_with('\t')) return false;
  for (skip_space(); !text.empty(); skip_space()) {
    if (!text.starts_with(';')) return false;
    text.remove_prefix(1);
    skip_space();
    if (text.starts_with('"') || !take_value(text)) return false;
    skip_space();
    if (!text.starts_with('=')) continue;
    text.remove_prefix(1);
    skip_space();
    if (!take_value(text)) return false;
  }
  return true;
}

}  // namespace

std::string_view ChunkedBody::next(std::string_view& received) {
  while (!received.empty() && part_ != Part::end && !problem_) {
    if (part_ == Part::data) {
      const std::string_view data = received.substr(0, std::min<std::uint64_t>(data_left_, received.size()));
      received.remove_prefix(data.size());
      data_left_ -= data.size();
      if (data_left_ == 0) part_ = Part::after_data;
      return data;
    }
    const std::size_t most = part_ == Part::size       ? kMostSizeDigits + kMostExtensions - extension_bytes_
                             : part_ == Part::trailers ? kMostTrailers - trailer_bytes_
                                                       : 0;
    if (take_line(received, most)) {
      read_line();
      line_.clear();
    }
  }
  return {};
}

bool ChunkedBody::take_line(std::string_view& received, std::size_t most) {
  constexpr std::size_t kEnd = 2;
  const std::size_t newline = received.find('\n');
  const std::size_t size = newline == std::string_view::npos ? received.size() : newline + 1;
  if (line_.size() + size > most + kEnd) {
    if (part_ == Part::size)
      problem_ = {ProblemCode::payload_too_large, "The chunks' extensions are too long.", {}};
    else if (part_ == Part::trailers)
      problem_ = {ProblemCode::headers_too_large, "The trailers are too long.", {}};
    else
      problem_ = malformed("A chunk isn't as long as it says.");
    return false;
  }
  line_.append(received.substr(0, size));
  received.remove_prefix(size);
  if (newline == std::string_view::npos) return false;
  if (!line_.ends_with("\r\n")) {
    problem_ = malformed("A line of the chunked body ends in LF without CR.");
    return false;
  }
  line_.resize(line_.size() - kEnd);
  return true;
}

void ChunkedBody::read_line() {
  switch (part_) {
    case Part::size:
      return read_size();
    case Part::after_data:
      if (!line_.empty()) problem_ = malformed("A chunk isn't as long as it says.");
      part_ = Part::size;
      return;
    case Part::trailers:
      trailer_bytes_ += line_.size();
      if (line_.empty())
        part_ = Part::end;
      else if (!is_field_line(line_))
        problem_ = malformed("A trailer isn't a name, a colon and a value.");
      return;
    case Part::data:
    case Part::end:
      return;  // They have no lines.
  }
}

void ChunkedBody::read_size() {
  const std::string_view line = line_;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), data_left_, 16);
  const auto digits = static_cast<std::size_t>(end - line.data());
  if (error != std::errc() || digits > kMostSizeDigits || line.starts_with('-')) {
    problem_ = malformed("The size of a chunk isn't a hexadecimal number.");
    return;
  }
  const std::string_view extensions = line.substr(digits);
  extension_bytes_ += extensions.size();
  if (!are_extensions(extensions)) {
    problem_ = malformed("The extension of a chunk isn't \";name\" or \";name=value\".");
    return;
  }
  part_ = data_left_ == 0 ? Part::trailers : Part::data;
}

}  // namespace tessera::server

#include "server/http/multipart.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "proto/wire/printable.h"
#include "server/http/http_syntax.h"
#include "server/http/media_type.h"

namespace tessera::server {
using proto::Problem;
using proto::ProblemCode;
using proto::Result;

namespace {

constexpr std::size_t kLongestBoundary = 70;
constexpr std::size_t kMostHeaderBytes = 8 << 10;
constexpr std::string_view kLineEnd = "\r\n";

/// What breaks the rules of forms; thrown, for it is found at many depths.
struct Malformed {
  std::string why;
};

/// Takes a quoted string or a token off the front of `text`. A backslash escapes a quote or itself, and is one
/// elsewhere: that is how clients write names of files.
std::string take_value(std::string_view& text) {
  std::string value;
  if (!text.starts_with('"')) {
    const std::size_t end = std::min(text.find_first_of("; \t"), text.size());
    value = text.substr(0, end);
    text.remove_prefix(end);
    if (!is_token(value)) throw Malformed{"A parameter's value is neither a token nor in quotes."};
    return value;
  }
  for (text.remove_prefix(1); !text.starts_with('"'); text.remove_prefix(1)) {
    if (text.size() > 1 && text[0] == '\\' && (text[1] == '"' || text[1] == '\\')) text.remove_prefix(1);
    if (text.empty()) throw Malformed{"A quote isn't closed."};
    value += text.front();
  }
  text.remove_prefix(1);
  return value;
}

struct Parameter {
  std::string_view name;
  std::string value;
};

/// The parameters after a header's first word: `; name=value; name="value"`.
std::vector<Parameter> parameters_of(std::string_view text) {
  std::vector<Parameter> parameters;
  text = trimmed(text.substr(std::min(text.find(';'), text.size())));
  while (!text.empty()) {
    if (text.front() != ';') throw Malformed{"Parameters of a header are separated by semicolons."};
    text = trimmed(text.substr(1));
    if (text.empty()) break;
    const std::size_t equals = std::min(text.find('='), text.size());
    const std::string_view name = text.substr(0, equals);
    if (!is_token(name) || equals == text.size()) throw Malformed{"A header's parameter isn't name=value."};
    text.remove_prefix(equals + 1);
    for (const Parameter& earlier : parameters)
      if (equal_but_for_case(earlier.name, name)) throw Malformed{"A header has the same parameter twice."};
    parameters.push_back({name, take_value(text)});
    text = trimmed(text);
  }
  return parameters;
}

std::optional<std::string> take_parameter(std::vector<Parameter>& parameters, std::string_view name) {
  for (Parameter& parameter : parameters)
    if (equal_but_for_case(parameter.name, name)) return std::move(parameter.value);
  return std::nullopt;
}

std::string boundary_of(std::string_view content_type) {
  auto parameters = parameters_of(content_type);
  auto boundary = take_parameter(parameters, "boundary");
  constexpr std::string_view kOthers = "'()+_,-./:=? ";
  const auto may_stand = [&](char c) {
    return ('0' <= c && c <= '9') || ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') ||
           kOthers.find(c) != kOthers.npos;
  };
  if (!boundary || boundary->empty() || boundary->size() > kLongestBoundary || boundary->ends_with(' ') ||
      !std::ranges::all_of(*boundary, may_stand))
    throw Malformed{"The Content-Type has no boundary as RFC 2046 wants it."};
  return *std::move(boundary);
}

/// A line that begins with two dashes and the boundary.
struct Delimiter {
  std::size_t begin;  ///< With the line end before it, which is its own.
  std::size_t end;    ///< After its line.
  bool is_last;
};

class FormParser {
 public:
  FormParser(std::string_view boundary, std::string_view body)
      : line_("--" + std::string(boundary)), delimiter_(std::string(kLineEnd) + line_), body_(body) {}

  std::vector<FormPart> parse() {
    std::vector<FormPart> parts;
    auto at = first();
    while (at && !at->is_last) {
      if (parts.size() == kMostParts)
        throw Malformed{"The form has more than " + std::to_string(kMostParts) + " parts."};
      // A part that is empty shares its line end with the headers' last one.
      const auto next = find(at->end - kLineEnd.size());
      if (!next) break;
      parts.push_back(parse_part(at->end, next->begin));
      at = next;
    }
    if (!at || !at->is_last) throw Malformed{"The form breaks off before its last boundary."};
    return parts;
  }

 private:
  std::optional<Delimiter> first() const {
    if (body_.starts_with(line_))
      if (const auto there = delimiter_at(0, line_.size())) return there;
    return find(0);
  }

  std::optional<Delimiter> find(std::size_t from) const {
    for (std::size_t at = from; (at = body_.find(delimiter_, at)) != body_.npos; ++at)
      if (const auto there = delimiter_at(at, at + delimiter_.size())) return there;
    return std::nullopt;
  }

  /// Nothing where the line goes on otherwise: then it only looks like one.
  std::optional<Delimiter> delimiter_at(std::size_t begin, std::size_t after) const {
    const bool is_last = body_.substr(after, 2) == "--";
    const std::size_t end = std::min(body_.find_first_not_of(" \t", is_last ? after + 2 : after), body_.size());
    if (is_last && end == body_.size()) return Delimiter{begin, end, true};
    if (body_.substr(end, kLineEnd.size()) != kLineEnd) return std::nullopt;
    return Delimiter{begin, end + kLineEnd.size(), is_last};
  }

  FormPart parse_part(std::size_t begin, std::size_t end) const {
    FormPart part;
    bool has_disposition = false;
    for (std::size_t at = begin;;) {
      const std::string_view rest = body_.substr(at, kMostHeaderBytes - std::min(at - begin, kMostHeaderBytes));
      const std::size_t line_end = rest.find(kLineEnd);
      if (line_end == rest.npos || at + line_end > end) throw Malformed{"A part's headers don't end, or are too long."};
      const std::string_view line = rest.substr(0, line_end);
      at += line_end + kLineEnd.size();
      if (line.empty()) {
        part.content = body_.substr(at, end - std::min(at, end));
        break;
      }
      read_header(line, part, has_disposition);
    }
    if (!has_disposition) throw Malformed{"A part has no Content-Disposition."};
    return part;
  }

  static void read_header(std::string_view line, FormPart& part, bool& has_disposition) {
    if (!is_field_line(line)) throw Malformed{"A part has a header that isn't one."};
    const std::string_view name = line.substr(0, line.find(':')), value = trimmed(line.substr(name.size() + 1));
    if (equal_but_for_case(name, "content-disposition")) {
      if (std::exchange(has_disposition, true)) throw Malformed{"A part has two headers Content-Disposition."};
      read_disposition(value, part);
    } else if (equal_but_for_case(name, "content-type")) {
      if (!part.content_type.empty()) throw Malformed{"A part has two headers Content-Type."};
      part.content_type = value;
    } else if (equal_but_for_case(name, "content-transfer-encoding")) {
      if (!equal_but_for_case(value, "binary") && !equal_but_for_case(value, "8bit") &&
          !equal_but_for_case(value, "7bit"))
        throw Malformed{"A part is encoded for transfer; send it as it is (RFC 7578, 4.7)."};
    }
  }

  static void read_disposition(std::string_view value, FormPart& part) {
    if (!is_media_type(value, "form-data")) throw Malformed{"A part's Content-Disposition isn't form-data."};
    auto parameters = parameters_of(value);
    auto name = take_parameter(parameters, "name");
    if (!name) throw Malformed{"A part has no name."};
    part.name = *std::move(name);
    part.file_name = take_parameter(parameters, "filename");
    const auto extended = take_parameter(parameters, "filename*");
    if (extended && !part.file_name) part.file_name = decoded(*extended);
  }

  /// Forms have no use for such a value (RFC 7578, 4.2), but some clients write it: charset'language'escaped (RFC
  /// 8187).
  static std::string decoded(std::string_view value) {
    const std::size_t language = value.find('\''), text = value.find('\'', language + 1);
    if (language != value.npos && text != value.npos && equal_but_for_case(value.substr(0, language), "utf-8")) {
      auto name = percent_decode(value.substr(text + 1));
      const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; };
      if (name && proto::is_utf8(*name) && std::ranges::none_of(*name, is_control)) return *std::move(name);
    }
    throw Malformed{"A part's filename* isn't UTF-8''name, with percent signs for what isn't ASCII (RFC 8187)."};
  }

  std::string line_, delimiter_;
  std::string_view body_;
};

}  // namespace

Result<std::vector<FormPart>> parse_form(std::string_view content_type, std::string_view body) {
  try {
    return FormParser(boundary_of(content_type), body).parse();
  } catch (const Malformed& malformed) {
    return Problem{ProblemCode::malformed_request, "The body isn't a form (multipart/form-data). " + malformed.why, {}};
  }
}

}  // namespace tessera::server

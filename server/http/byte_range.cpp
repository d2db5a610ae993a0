#include "server/http/byte_range.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace tessera::server {
namespace {

/// Bytes from the first to the last, or the last so many where there is no first. Nothing: to the end.
struct AskedRange {
  std::optional<std::uint64_t> first, last;
};

/// Digits, as many as there are: a number that is too large is as good as any that is.
bool read_digits(std::string_view text, std::optional<std::uint64_t>& value) {
  if (text.empty()) return true;
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error == std::errc::invalid_argument || end != text.data() + text.size()) return false;
  value = error == std::errc() ? number : std::numeric_limits<std::uint64_t>::max();
  return true;
}

/// The one range of a Range header; nothing where there are several, or none of bytes (RFC 9110, 14.1.2, 14.2).
std::optional<AskedRange> read_range(std::string_view header) {
  constexpr std::string_view kUnit = "bytes=";
  const auto is_same = [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b; };
  if (header.size() < kUnit.size() || !std::ranges::equal(header.substr(0, kUnit.size()), kUnit, is_same))
    return std::nullopt;
  header.remove_prefix(kUnit.size());
  const std::size_t dash = header.find('-');
  AskedRange asked;
  if (dash == header.npos || !read_digits(header.substr(0, dash), asked.first) ||
      !read_digits(header.substr(dash + 1), asked.last) || (!asked.first && !asked.last) ||
      (asked.first && asked.last && *asked.last < *asked.first))
    return std::nullopt;
  return asked;
}

std::string_view etag_of(const Response& response) {
  const auto found = std::ranges::find(response.headers, "ETag", &std::pair<std::string, std::string>::first);
  return found == response.headers.end() ? std::string_view{} : std::string_view(found->second);
}

}  // namespace

void answer_range(const Request& request, Response& response) {
  response.headers.emplace_back("Accept-Ranges", "bytes");
  const auto header = request.header("range");
  if (!header || request.is_head) return;
  // By strong comparison, which a weak tag and a date never pass (RFC 9110, 13.1.5).
  if (const auto known = request.header("if-range"); known && *known != etag_of(response)) return;
  const auto asked = read_range(*header);
  if (!asked) return;

  const std::uint64_t size = response.content().size();
  const std::uint64_t first = asked->first ? *asked->first : size - std::min(size, *asked->last);
  if (first >= size) {
    const std::string whole = std::to_string(size);
    response = problem_response(
        {proto::ProblemCode::range_not_satisfiable, "There are " + whole + " bytes, and none of those asked for.", {}});
    response.headers.emplace_back("Content-Range", "bytes */" + whole);
    return;
  }
  const std::uint64_t last = asked->first && asked->last ? std::min(*asked->last, size - 1) : size - 1;
  response.status = 206;
  response.part = {first, last - first + 1};
  response.headers.emplace_back(
      "Content-Range", "bytes " + std::to_string(first) + '-' + std::to_string(last) + '/' + std::to_string(size));
}

}  // namespace tessera::server

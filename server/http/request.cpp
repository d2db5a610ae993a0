#include "server/http/request.h"

#include <algorithm>

#include "proto/wire/printable.h"
#include "server/http/http_syntax.h"

namespace tessera::server {
namespace {

/// Calls `piece` for each part of `text` between separators, until it returns false.
template <typename Piece>
bool for_each_piece(std::string_view text, char separator, Piece piece) {
  for (;;) {
    const std::size_t end = text.find(separator);
    if (!piece(text.substr(0, end))) return false;
    if (end == std::string_view::npos) return true;
    text.remove_prefix(end + 1);
  }
}

/// What follows "http://": every server has to take the absolute form (RFC 9112, 3.2.2). Nothing for other forms.
std::optional<std::string_view> after_scheme(std::string_view text) {
  constexpr std::string_view kScheme = "http://";
  if (!equal_but_for_case(text.substr(0, kScheme.size()), kScheme)) return std::nullopt;
  return text.substr(kScheme.size());
}

}  // namespace

std::optional<Target> parse_target(std::string_view given) {
  Target target;
  std::string path_and_query(given);
  if (const auto absolute = after_scheme(given)) {
    const std::size_t end = std::min(absolute->find_first_of("/?#"), absolute->size());
    target.authority = absolute->substr(0, end);
    if (end == 0 || absolute->front() == ':' || !is_host(target.authority)) return std::nullopt;
    path_and_query = (absolute->substr(end).starts_with('/') ? "" : "/") + std::string(absolute->substr(end));
  }
  if (!path_and_query.starts_with('/') || !is_path_and_query(path_and_query)) return std::nullopt;
  const std::string_view text = path_and_query;
  const std::size_t question = text.find('?');
  const std::string_view path = text.substr(1, question == std::string_view::npos ? question : question - 1);
  const bool path_ok = for_each_piece(path, '/', [&](std::string_view segment) {
    auto decoded = percent_decode(segment);
    if (decoded) target.segments.push_back(*std::move(decoded));
    return decoded.has_value();
  });
  if (!path_ok) return std::nullopt;
  if (question == std::string_view::npos) return target;
  const bool query_ok = for_each_piece(text.substr(question + 1), '&', [&](std::string_view pair) {
    if (pair.empty()) return true;
    const std::size_t equals = pair.find('=');
    auto name = percent_decode(pair.substr(0, equals));
    auto value = percent_decode(equals == std::string_view::npos ? std::string_view{} : pair.substr(equals + 1));
    if (!name || !value || !proto::is_utf8(*value)) return false;
    target.query.emplace_back(*std::move(name), *std::move(value));
    return true;
  });
  if (!query_ok) return std::nullopt;
  return target;
}

std::optional<std::string_view> Request::host() const {
  if (!target.authority.empty()) return target.authority;
  return header("host");
}

std::optional<std::string_view> Request::header(const std::string& lower_case_name) const {
  const auto found = headers.find(lower_case_name);
  if (found == headers.end()) return std::nullopt;
  return found->second;
}

std::optional<std::string_view> Request::query(std::string_view name) const {
  for (const auto& [key, value] : target.query)
    if (key == name) return value;
  return std::nullopt;
}

}  // namespace tessera::server

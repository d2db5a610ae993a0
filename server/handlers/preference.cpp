#include "server/handlers/preference.h"

#include <charconv>
#include <string_view>
#include <system_error>

#include "server/http/http_syntax.h"

namespace tessera::server {

std::string Preference::applied() const {
  std::string text = respond_async ? "respond-async" : "";
  if (wait) text += (text.empty() ? "wait=" : ", wait=") + std::to_string(wait->count());
  return text;
}

std::optional<std::chrono::steady_clock::time_point> Preference::until(
    std::chrono::steady_clock::time_point begin) const {
  if (wait) return begin + *wait;
  return respond_async ? std::optional(begin) : std::nullopt;
}

Preference read_preference(const Request& request) {
  constexpr unsigned kMostSeconds = 24 * 3600;
  Preference preference;
  std::string_view list = request.header("prefer").value_or("");
  while (!list.empty()) {
    const std::size_t comma = list.find(',');
    std::string_view item = list.substr(0, comma);
    list = comma == std::string_view::npos ? std::string_view{} : list.substr(comma + 1);
    item = trimmed(item.substr(0, item.find(';')));
    if (equal_but_for_case(item, "respond-async")) preference.respond_async = true;
    const std::size_t equals = item.find('=');
    if (equals == std::string_view::npos || !equal_but_for_case(trimmed(item.substr(0, equals)), "wait")) continue;
    const std::string_view text = trimmed(item.substr(equals + 1));
    unsigned seconds = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
    const bool is_good = error == std::errc() && end == text.data() + text.size() && seconds <= kMostSeconds;
    if (is_good && !preference.wait) preference.wait = std::chrono::seconds(seconds);  // the first one counts
  }
  return preference;
}

}  // namespace tessera::server

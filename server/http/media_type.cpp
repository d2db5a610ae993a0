#include "server/http/media_type.h"

#include <charconv>
#include <system_error>

#include "server/http/http_syntax.h"

namespace tessera::server {
namespace {

/// Takes the part up to the separator off the front of `text`.
std::string_view take_part(std::string_view& text, char separator) {
  const std::size_t end = text.find(separator);
  const std::string_view part = trimmed(text.substr(0, end));
  text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
  return part;
}

/// How closely a media range covers a type: 3 exactly, 2 as "image/*", 1 as "*/*", 0 not.
int specificity(std::string_view range, std::string_view media_type) {
  if (equal_but_for_case(range, media_type)) return 3;
  if (range == "*/*") return 1;
  const std::string_view family = media_type.substr(0, media_type.find('/') + 1);
  return range.size() == family.size() + 1 && range.ends_with("/*") &&
                 equal_but_for_case(range.substr(0, family.size()), family)
             ? 2
             : 0;
}

double quality(std::string_view parameters) {
  while (!parameters.empty()) {
    const std::string_view parameter = take_part(parameters, ';');
    if (!equal_but_for_case(parameter.substr(0, 2), "q=")) continue;
    const std::string_view number = parameter.substr(2);
    double q = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), q);
    const bool readable = error == std::errc() && end == number.data() + number.size() && q >= 0 && q <= 1;
    return readable ? q : 0;
  }
  return 1;
}

}  // namespace

bool is_media_type(std::string_view content_type, std::string_view media_type) {
  return equal_but_for_case(take_part(content_type, ';'), media_type);
}

double acceptance(std::string_view accept, std::string_view media_type) {
  int best = 0;
  double weight = 0;
  while (!accept.empty()) {
    std::string_view entry = take_part(accept, ',');
    const int match = specificity(take_part(entry, ';'), media_type);
    if (match <= best) continue;
    best = match;
    weight = quality(entry);
  }
  return weight;
}

}  // namespace tessera::server

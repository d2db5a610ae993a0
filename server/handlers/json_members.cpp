#include "server/handlers/json_members.h"

#include <algorithm>
#include <cstddef>

#include <nlohmann/json.hpp>

namespace tessera::server {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

/// After the string that begins at `at`, or the text's end.
std::size_t after_string(std::string_view text, std::size_t at) {
  for (++at; at < text.size() && text[at] != '"'; ++at)
    if (text[at] == '\\') ++at;
  return std::min(at + 1, text.size());
}

/// After the value that begins at `at`.
std::size_t after_value(std::string_view text, std::size_t at) {
  std::size_t depth = 0;
  while (at < text.size()) {
    const char c = text[at];
    if (c == '"') {
      at = after_string(text, at);
      continue;
    }
    if (depth == 0 && (c == ',' || c == '}' || c == ']')) break;
    if (c == '{' || c == '[') ++depth;
    if (c == '}' || c == ']') --depth;
    ++at;
  }
  return at;
}

}  // namespace

std::vector<JsonMember> json_members(std::string_view text) {
  std::vector<JsonMember> members;
  const auto skip_blanks = [&](std::size_t at) { return std::min(text.find_first_not_of(kBlanks, at), text.size()); };
  const auto is_at = [&](std::size_t at, char c) { return at < text.size() && text[at] == c; };
  std::size_t at = skip_blanks(0);
  if (!is_at(at, '{')) return members;
  do {
    const std::size_t name = skip_blanks(at + 1), name_end = is_at(name, '"') ? after_string(text, name) : name;
    const std::size_t colon = skip_blanks(name_end);
    if (name_end == name || !is_at(colon, ':')) break;
    const auto unescaped = nlohmann::json::parse(text.substr(name, name_end - name), nullptr, false);
    const std::size_t value = skip_blanks(colon + 1);
    at = after_value(text, value);
    if (unescaped.is_string()) members.push_back({unescaped.get<std::string>(), text.substr(value, at - value)});
  } while (is_at(at, ','));
  return members;
}

std::vector<std::string_view> json_elements(std::string_view text) {
  std::vector<std::string_view> elements;
  const auto skip_blanks = [&](std::size_t at) { return std::min(text.find_first_not_of(kBlanks, at), text.size()); };
  std::size_t at = skip_blanks(0);
  if (at == text.size() || text[at] != '[') return elements;
  do {
    const std::size_t value = skip_blanks(at + 1);
    at = after_value(text, value);
    if (at > value) elements.push_back(text.substr(value, at - value));
  } while (at < text.size() && text[at] == ',');
  return elements;
}

bool has_member(std::string_view text, std::string_view name) {
  const std::vector<JsonMember> members = json_members(text);
  return std::ranges::find(members, name, &JsonMember::name) != members.end();
}

}  // namespace tessera::server

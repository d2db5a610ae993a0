#include "client/accel_argument.h"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <vector>

#include <nlohmann/json.hpp>

namespace tessera::client {
namespace {

using nlohmann::json;

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

template <typename T>
std::optional<T> all_of(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<json> parse_number(std::string_view text) {
  if (const auto whole = all_of<std::int64_t>(text)) return *whole;
  const auto real = all_of<double>(text);
  if (real && std::isfinite(*real)) return *real;  // JSON has no other numbers
  return std::nullopt;
}

std::optional<json> parse_vectors(std::string_view text) {
  json vectors = json::array();
  for (const std::string_view vector : split(text, '/')) {
    json coordinates = json::array();
    for (const std::string_view coordinate : split(vector, ':')) {
      const auto number = parse_number(coordinate);
      if (!number) return std::nullopt;
      coordinates.push_back(*number);
    }
    vectors.push_back(std::move(coordinates));
  }
  return vectors;
}

std::optional<json> parse_value(std::string_view text) {
  if (text.empty()) return std::nullopt;
  if (text.find(':') != std::string_view::npos) return parse_vectors(text);
  if (auto number = parse_number(text)) return number;
  return json(text);
}

std::string value_text(const json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_array()) return value.dump();
  std::string text;
  for (const json& element : value) {
    if (!text.empty()) text += value.front().is_array() ? '/' : ':';
    text += value_text(element);
  }
  return text;
}

}  // namespace

std::optional<json> parse_accel(std::string_view text) {
  const auto parts = split(text, ',');
  json accel{{"kind", parts[0]}};
  if (parts[0].empty()) return std::nullopt;
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const std::size_t equals = parts[i].find('=');
    if (equals == std::string_view::npos) return std::nullopt;
    auto value = parse_value(parts[i].substr(equals + 1));
    const bool is_new = value && accel.emplace(parts[i].substr(0, equals), *std::move(value)).second;
    if (!is_new) return std::nullopt;
  }
  return accel;
}

std::string accel_argument(const std::string& kind, const json& options) {
  std::string text = kind;
  for (const auto& [name, value] : options.items()) text += ',' + name + '=' + value_text(value);
  return text;
}

}  // namespace tessera::client

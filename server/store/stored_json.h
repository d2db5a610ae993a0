#pragma once

#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string_view>

#include <nlohmann/json.hpp>

/// Reading of JSON that this program has written to the disk, where it may have become anything since.
namespace tessera::server {

/// Throws std::exception for what is no JSON, or nested deeper than what is written: what takes values apart, or writes
/// them, goes as deep as they do.
inline nlohmann::json parse_stored(std::string_view text) {
  constexpr int kDeepest = 32;
  return nlohmann::json::parse(text, [](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
    if (depth > kDeepest) throw std::runtime_error("it is nested too deeply");
    return true;
  });
}

/// A whole number that T can hold. Throws std::exception for any other value.
template <typename T>
T stored_number(const nlohmann::json& value) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > std::numeric_limits<T>::max())
    throw std::runtime_error("this isn't a number that it could be: " + value.dump());
  return value.get<T>();
}

}  // namespace tessera::server

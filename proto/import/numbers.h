#pragma once

#include <charconv>
#include <concepts>
#include <cstdint>
#include <optional>
#include <string_view>

#include "proto/import/text_cursor.h"

namespace tessera::proto {

/// Reads the whole of `text` as a decimal number, whatever the locale: "1", "+1", "1.", ".5", "1e+5", "nan",
/// "-inf", Microsoft's "1.#INF". Correctly rounded; beyond float's range it is ±infinity, below it ±0. Nothing for
/// anything else ("0x10", "1,5", "1e", "").
std::optional<float> parse_float(std::string_view text);

/// Reads the whole of `text` as a decimal integer, with an optional sign; nothing when it isn't one or doesn't fit.
template <std::integral T>
std::optional<T> parse_integer(std::string_view text) {
  if (text.starts_with('+')) {
    text.remove_prefix(1);
    if (text.starts_with('-')) return std::nullopt;
  }
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// What `parse_float` and `parse_integer` make of the next token, much faster for the forms that files are full of.
/// Nothing when the token is no number, or there is none; then the cursor still stands before it. The cursor must be
/// one without comments.
std::optional<float> next_float(TextCursor& words);
std::optional<std::int64_t> next_integer(TextCursor& words);

}  // namespace tessera::proto

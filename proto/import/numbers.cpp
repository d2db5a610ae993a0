#include "proto/import/numbers.h"

#include <cmath>
#include <cstdint>
#include <limits>

namespace tessera::proto {
namespace {

/// What a number beyond float's range rounds to, from the place of its first digit that isn't 0. `text` is a valid
/// decimal number without its sign.
float out_of_range_value(std::string_view text) {
  const std::size_t exponent_at = text.find_first_of("eE");
  const std::string_view digits = text.substr(0, exponent_at);
  const std::size_t first = digits.find_first_not_of("0.");
  if (first == std::string_view::npos) return 0;
  const auto point = static_cast<std::int64_t>(std::min(digits.find('.'), digits.size()));
  const auto place = static_cast<std::int64_t>(first);

  std::int64_t exponent = 0;
  if (exponent_at != std::string_view::npos) {
    const std::string_view written = text.substr(exponent_at + 1);
    exponent = parse_integer<std::int64_t>(written).value_or(written.starts_with('-') ? -1'000'000'000'000
                                                                                      : 1'000'000'000'000);
  }
  return point - place + exponent > 0 ? std::numeric_limits<float>::infinity() : 0;
}

/// How Microsoft's older libraries print what isn't finite: 1.#INF, 1.#IND000, 1.#QNAN.
std::optional<float> parse_microsoft(std::string_view text) {
  if (text.starts_with("1.#INF")) return std::numeric_limits<float>::infinity();
  if (text.starts_with("1.#")) return std::numeric_limits<float>::quiet_NaN();
  return std::nullopt;
}

}  // namespace

std::optional<float> parse_float(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  if (text.empty() || text.front() == '-' || text.front() == '+') return std::nullopt;

  float value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::invalid_argument) return std::nullopt;
  if (end != text.data() + text.size()) {
    const std::optional<float> special = parse_microsoft(text);
    return special && negative ? -*special : special;
  }
  if (error == std::errc::result_out_of_range) value = out_of_range_value(text);
  return negative ? -value : value;
}

}  // namespace tessera::proto

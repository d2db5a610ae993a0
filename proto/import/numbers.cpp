#include "proto/import/numbers.h"

#include <algorithm>
#include <array>
#include <bit>
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

/// Moves `at` over decimal digits and appends them to `value`, which wraps beyond 19.
void read_digits(const char*& at, const char* end, std::uint64_t& value) {
  for (; at != end && *at >= '0' && *at <= '9'; ++at) value = 10 * value + static_cast<std::uint64_t>(*at - '0');
}

bool is_token_end(const char* at, const char* end) { return at == end || TextCursor::is_blank(*at); }

/// Powers of ten that a double holds exactly.
constexpr std::array<double, 23> kPowers{1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                         1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

/// digits · 10^exponent, correctly rounded; nothing where that takes more than one operation in double. Both operands
/// are exact, so the operation rounds once (Clinger, "How to Read Floating Point Numbers Accurately", 1990). Rounding
/// its result to float is wrong only where it lies half-way between two floats without being the number itself.
std::optional<float> plain_value(std::uint64_t digits, std::int64_t exponent) {
  constexpr auto kLargestExponent = static_cast<std::int64_t>(kPowers.size()) - 1;
  if (digits >> 53 != 0 || exponent < -kLargestExponent || exponent > kLargestExponent) return std::nullopt;
  const double power = kPowers[static_cast<std::size_t>(std::abs(exponent))];
  const double value = exponent < 0 ? static_cast<double>(digits) / power : static_cast<double>(digits) * power;
  const bool is_normal = value >= std::numeric_limits<float>::min() && value < std::numeric_limits<float>::max();
  constexpr std::uint64_t kBelowFloat = (1ULL << 29) - 1, kHalf = 1ULL << 28;
  const bool is_half_way = (std::bit_cast<std::uint64_t>(value) & kBelowFloat) == kHalf;
  if (is_half_way || !(is_normal || digits == 0)) return std::nullopt;
  return static_cast<float>(value);
}

/// The number at `at`, up to the token's end, in the forms "-1", "1.5" and "1.5e-05"; nothing, with `at` anywhere, for
/// all others.
std::optional<float> read_plain_float(const char*& at, const char* end) {
  const bool is_negative = at != end && *at == '-';
  if (is_negative) ++at;
  std::uint64_t digits = 0;
  const char* const first = at;
  read_digits(at, end, digits);
  std::ptrdiff_t count = at - first;
  std::int64_t exponent = 0;
  if (at != end && *at == '.') {
    const char* const fraction = ++at;
    read_digits(at, end, digits);
    exponent = fraction - at;
    count += at - fraction;
  }
  if (count < 1 || count > 19) return std::nullopt;
  if (at != end && (*at == 'e' || *at == 'E')) {
    ++at;
    const bool is_small = at != end && *at == '-';
    if (at != end && (*at == '-' || *at == '+')) ++at;
    const char* const written_at = at;
    std::uint64_t written = 0;
    read_digits(at, end, written);
    if (at == written_at || at - written_at > 3) return std::nullopt;
    exponent += is_small ? -static_cast<std::int64_t>(written) : static_cast<std::int64_t>(written);
  }
  if (!is_token_end(at, end)) return std::nullopt;
  const std::optional<float> value = plain_value(digits, exponent);
  return value && is_negative ? -*value : value;
}

/// The same for "12" and "-12".
std::optional<std::int64_t> read_plain_integer(const char*& at, const char* end) {
  const bool is_negative = at != end && *at == '-';
  if (is_negative) ++at;
  const char* const first = at;
  std::uint64_t digits = 0;
  read_digits(at, end, digits);
  if (at == first || at - first > 18 || !is_token_end(at, end)) return std::nullopt;
  const auto value = static_cast<std::int64_t>(digits);
  return is_negative ? -value : value;
}

template <typename Number>
std::optional<Number> next_number(TextCursor& words, std::optional<Number> (&read_plain)(const char*&, const char*),
                                  std::optional<Number> (&parse)(std::string_view)) {
  const std::string_view ahead = words.ahead();
  const char* at = ahead.data();
  if (const std::optional<Number> value = read_plain(at, ahead.data() + ahead.size())) {
    words.pass(static_cast<std::size_t>(at - ahead.data()));
    return value;
  }
  const TextCursor before = words;
  const std::optional<Number> value = parse(words.next());
  if (!value) words = before;
  return value;
}

}  // namespace

std::optional<float> next_float(TextCursor& words) { return next_number(words, read_plain_float, parse_float); }

std::optional<std::int64_t> next_integer(TextCursor& words) {
  return next_number(words, read_plain_integer, parse_integer<std::int64_t>);
}

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

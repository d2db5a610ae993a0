#include "proto/import/numbers.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <random>
#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace tessera::proto {
namespace {

TEST(ParseFloat, ReadsEveryDecimalForm) {
  EXPECT_EQ(parse_float("1"), 1.0F);
  EXPECT_EQ(parse_float("+1"), 1.0F);
  EXPECT_EQ(parse_float("-1.5"), -1.5F);
  EXPECT_EQ(parse_float("1."), 1.0F);
  EXPECT_EQ(parse_float(".5"), 0.5F);
  EXPECT_EQ(parse_float("+.5"), 0.5F);
  EXPECT_EQ(parse_float("-.5e1"), -5.0F);
  EXPECT_EQ(parse_float("1e+5"), 1e5F);
  EXPECT_EQ(parse_float("1E-5"), 1e-5F);
  EXPECT_EQ(parse_float("2.e1"), 20.0F);
  EXPECT_EQ(parse_float("007"), 7.0F);
  EXPECT_EQ(parse_float("0.1000000014901161193847656250000001"), 0.1F);
}

TEST(ParseFloat, RefusesAllElse) {
  for (const char* text : {"", "+", "-", ".", "e5", "1e", "1e+", "0x10", "1,5", "1.5f", "3.1+e2", "--1", "+-1", "-+1",
                           "++1", " 1", "1 ", "one", "1..2"}) {
    EXPECT_EQ(parse_float(text), std::nullopt) << '"' << text << '"';
  }
}

TEST(ParseFloat, ReadsWhatIsNotFinite) {
  EXPECT_TRUE(std::isnan(parse_float("nan").value()));
  EXPECT_TRUE(std::isnan(parse_float("-NaN").value()));
  EXPECT_EQ(parse_float("inf"), INFINITY);
  EXPECT_EQ(parse_float("-Infinity"), -INFINITY);
  EXPECT_EQ(parse_float("-1.#INF"), -INFINITY);
  EXPECT_TRUE(std::isnan(parse_float("1.#QNAN0").value()));
}

TEST(ParseFloat, BeyondTheRangeIsInfinityOrZero) {
  EXPECT_EQ(parse_float("1e39"), INFINITY);
  EXPECT_EQ(parse_float("-1e99999999999999999999999"), -INFINITY);
  EXPECT_EQ(parse_float("1e-99999999999999999999999"), 0.0F);
  EXPECT_EQ(parse_float("1e-60"), 0.0F);
  EXPECT_TRUE(std::signbit(parse_float("-1e-60").value()));
  EXPECT_EQ(parse_float("0." + std::string(400, '0') + "1"), 0.0F);
  EXPECT_EQ(parse_float("1" + std::string(400, '0') + "e-10"), INFINITY);
  EXPECT_EQ(parse_float("0.0001e999"), INFINITY);
  EXPECT_EQ(parse_float("1e-45"), 1e-45F);
  EXPECT_EQ(parse_float("0e999"), 0.0F);
}

TEST(ParseInteger, ReadsSignsAndRefusesWhatDoesNotFit) {
  EXPECT_EQ(parse_integer<int>("-12"), -12);
  EXPECT_EQ(parse_integer<int>("+12"), 12);
  EXPECT_EQ(parse_integer<std::uint8_t>("255"), 255);
  EXPECT_EQ(parse_integer<std::uint8_t>("256"), std::nullopt);
  EXPECT_EQ(parse_integer<std::uint8_t>("-1"), std::nullopt);
  for (const char* text : {"", "+", "+-1", "1.0", "0x1", "1 "}) EXPECT_EQ(parse_integer<int>(text), std::nullopt);
}

/// What `next_float` makes of a text's first token, and where it stops.
std::pair<std::optional<float>, std::string_view> first_float(std::string_view text) {
  TextCursor words(text, TextCursor::kNoComment);
  const std::optional<float> value = next_float(words);
  return {value, words.rest()};
}

std::string formatted(const char* format, int digits, double value) {
  char text[128];
  std::snprintf(text, sizeof text, format, digits, value);
  return text;
}

void expect_parsed_alike(const std::string& text) {
  const auto [value, rest] = first_float(text);
  const std::optional<float> expected = parse_float(text);
  ASSERT_EQ(value.has_value(), expected.has_value()) << text;
  if (!value) return;
  ASSERT_EQ(std::bit_cast<std::uint32_t>(*value), std::bit_cast<std::uint32_t>(*expected)) << text;
  ASSERT_EQ(rest, "") << text;
}

TEST(NextFloat, IsParseFloatToTheBit) {
  for (const char* text : {"0",
                           "-0",
                           "1",
                           "-1.5",
                           "1.",
                           ".5",
                           "-.5e1",
                           "+2",
                           "1e+5",
                           "1E-05",
                           "1e5",
                           "0e999",
                           "1e39",
                           "-1e-60",
                           "1e-45",
                           "1.17549435e-38",
                           "1.17549421e-38",
                           "3.4028236e38",
                           "9007199254740993",
                           "99999999999999999999999",
                           "0.00000000000000000000000000000000000001",
                           "nan",
                           "-inf",
                           "1.#IND",
                           "e5",
                           ".",
                           "-",
                           "1e",
                           "1e+",
                           "0x10",
                           "1,5",
                           "1-2",
                           "--1",
                           "1.2.3"}) {
    expect_parsed_alike(text);
  }
  // Between 8.0000009537 and 8.0000019073, just below the middle, which is what the nearest double is.
  EXPECT_EQ(first_float("8.000001430511474").first, 8.000000953674316F);
}

TEST(NextFloat, IsParseFloatToTheBitForRandomNumbers) {
  for (unsigned seed = 0; seed < 100'000; ++seed) {
    std::mt19937 random(seed);
    const auto value = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    if (!std::isfinite(value)) continue;
    const double middle = (double{value} + double{std::nextafter(value, INFINITY)}) / 2;
    const int digits = 1 + static_cast<int>(random() % 18);
    for (const double number : {double{value}, middle, std::ldexp(double(random()), -28), double(random() % 100'000)}) {
      for (const char* format : {"%.*g", "%.*e", "%.*f"}) {
        ASSERT_NO_FATAL_FAILURE(expect_parsed_alike(formatted(format, digits, number))) << "seed " << seed;
      }
    }
  }
}

TEST(NextFloat, TakesOneTokenAndLeavesWhatIsNone) {
  TextCursor words("  1.5\t-2\n 3x 4", TextCursor::kNoComment);
  EXPECT_EQ(next_float(words), 1.5F);
  EXPECT_EQ(next_float(words), -2.0F);
  EXPECT_EQ(words.line(), 1U);
  EXPECT_EQ(next_float(words), std::nullopt);
  EXPECT_EQ(words.line(), 2U);
  EXPECT_EQ(words.next(), "3x");
  EXPECT_EQ(next_float(words), 4.0F);
  EXPECT_EQ(next_float(words), std::nullopt);
}

TEST(NextInteger, IsParseInteger) {
  for (const char* text : {"0", "-0", "12", "-12", "+12", "999999999999999999", "9223372036854775807",
                           "-9223372036854775808", "9223372036854775808", "", "-", "+", "+-1", "1.0", "1x", "0x1"}) {
    TextCursor words(text, TextCursor::kNoComment);
    EXPECT_EQ(next_integer(words), parse_integer<std::int64_t>(text)) << text;
  }
}

}  // namespace
}  // namespace tessera::proto

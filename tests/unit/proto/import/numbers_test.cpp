#include "proto/import/numbers.h"

#include <cmath>
#include <cstdint>
#include <string>

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

}  // namespace
}  // namespace tessera::proto

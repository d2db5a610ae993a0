#include "server/http/chunked_body.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

TEST(ChunkedBody, IsTheSameHoweverItComes) {
  const std::string text = "3;a=b\r\nabc\r\n0a\r\n0123456789\r\n0\r\nX: y\r\n\r\nGET";
  for (std::size_t step = 1; step <= text.size(); ++step) {
    ChunkedBody body;
    std::string data;
    std::size_t left = 0;
    for (std::size_t at = 0; at < text.size() && !body.is_complete(); at += step) {
      std::string_view received = std::string_view(text).substr(at, step);
      for (std::string_view piece = body.next(received); !piece.empty(); piece = body.next(received)) data += piece;
      ASSERT_FALSE(body.problem()) << body.problem()->detail;
      EXPECT_TRUE(body.is_complete() || received.empty());
      left = text.size() - std::min(at + step, text.size()) + received.size();
    }
    EXPECT_TRUE(body.is_complete());
    EXPECT_EQ(data, "abc0123456789");
    EXPECT_EQ(left, 3U);
  }
}

/// Bytes that are taken of an endless repetition before it is refused.
std::size_t taken_of(std::string_view begin, std::string_view repeated) {
  ChunkedBody body;
  body.next(begin);
  std::size_t taken = 0;
  while (!body.problem() && taken < (1 << 20)) {
    std::string_view received = repeated;
    while (!received.empty() && !body.problem()) body.next(received);
    taken += repeated.size();
  }
  return taken;
}

TEST(ChunkedBody, NothingIsTakenWithoutEnd) {
  const std::size_t most = ChunkedBody::kMostExtensions + 100;
  for (const char* begin : {"1;", "1;a=\"", "0;a=", "0", "0\r\nX", "0\r\nX: "}) EXPECT_LT(taken_of(begin, "0"), most);
  EXPECT_LT(taken_of("0\r\n", "X: y\r\n"), 2 * most);
  EXPECT_LT(taken_of("", "1;aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\r\nx\r\n"), 2 * most);
}

}  // namespace
}  // namespace tessera::server

#include "server/http/request_head.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

using proto::ProblemCode;

// tests/e2e/http_test.py has the table of what is taken and refused; here is what can't be seen from outside.

TEST(RequestHead, IsTheSameHoweverItComes) {
  const std::string text = "\r\nPOST /a HTTP/1.1\r\nHost: b\r\nX: 1\r\nx:2 \r\nContent-Length: 3\r\n\r\nabc";
  for (std::size_t step = 1; step <= text.size(); ++step) {
    RequestHeadParser parser;
    std::size_t given = 0;
    while (!parser.is_complete()) {
      given = std::min(given + step, text.size());
      ASSERT_FALSE(parser.advance(std::string_view(text).substr(0, given)));
      ASSERT_TRUE(given < text.size() || parser.is_complete());
    }
    EXPECT_EQ(parser.size(), text.size() - 3);
    EXPECT_EQ(parser.head().method, "POST");
    EXPECT_EQ(parser.head().target, "/a");
    EXPECT_EQ(parser.head().headers.at("x"), "1, 2");
    EXPECT_EQ(parser.head().content_length, 3U);
    EXPECT_TRUE(parser.head().keep_alive);
  }
}

TEST(RequestHead, NothingHasBegunWithAnEmptyLine) {
  RequestHeadParser parser;
  EXPECT_FALSE(parser.advance(""));
  EXPECT_FALSE(parser.has_begun());
  EXPECT_FALSE(parser.advance("\r\n\r"));
  EXPECT_FALSE(parser.has_begun());
  EXPECT_FALSE(parser.advance("\r\n\r\nG"));
  EXPECT_TRUE(parser.has_begun());
}

TEST(RequestHead, NeverWantsMoreThanItSays) {
  for (const char* begin : {"", "GET /", "GET / HTTP/1.1\r\nX: ", "\r\n\r\n\r\n\r\nGET /"}) {
    RequestHeadParser parser;
    const std::string text = begin + std::string(RequestHeadParser::kMostBytes, 'a');
    EXPECT_TRUE(parser.advance(std::string_view(text).substr(0, RequestHeadParser::kMostBytes))) << begin;
  }
}

TEST(RequestHead, KeepsTheMethodOfWhatItRefuses) {
  RequestHeadParser parser;
  EXPECT_TRUE(parser.advance("HEAD / HTTP/1.1\r\n\r\n"));
  EXPECT_EQ(parser.head().method, "HEAD");
}

}  // namespace
}  // namespace tessera::server

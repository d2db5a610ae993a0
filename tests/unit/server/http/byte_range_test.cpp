#include "server/http/byte_range.h"

#include <string>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

constexpr const char* kTag = "\"tag\"";

/// Status, Content-Range and bytes of the answer whose ten bytes these are.
std::string ask_for(const std::string& range, const std::string& if_range = "", bool is_head = false) {
  Request request;
  request.method = "GET";
  request.is_head = is_head;
  if (!range.empty()) request.headers["range"] = range;
  if (!if_range.empty()) request.headers["if-range"] = if_range;
  Response response{200, {{"ETag", kTag}}, "0123456789"};
  answer_range(request, response);
  std::string told = std::to_string(response.status);
  for (const auto& [name, value] : response.headers)
    if (name == "Content-Range") told += ' ' + value;
  return response.status == 416 ? told : told + ' ' + std::string(response.content());
}

// RFC 9110, 14.1.2 and 14.4.
TEST(ByteRange, IsAPartOfTheWhole) {
  EXPECT_EQ(ask_for("bytes=0-0"), "206 bytes 0-0/10 0");
  EXPECT_EQ(ask_for("bytes=2-4"), "206 bytes 2-4/10 234");
  EXPECT_EQ(ask_for("bytes=7-"), "206 bytes 7-9/10 789");
  EXPECT_EQ(ask_for("bytes=-3"), "206 bytes 7-9/10 789");
  EXPECT_EQ(ask_for("Bytes=9-9"), "206 bytes 9-9/10 9");
  EXPECT_EQ(ask_for("bytes=0-99"), "206 bytes 0-9/10 0123456789");
  EXPECT_EQ(ask_for("bytes=-99"), "206 bytes 0-9/10 0123456789");
  EXPECT_EQ(ask_for("bytes=1-99999999999999999999999999"), "206 bytes 1-9/10 123456789");
}

TEST(ByteRange, CantBeWhereNothingIs) {
  for (const char* range : {"bytes=10-", "bytes=10-12", "bytes=-0", "bytes=99999999999999999999999999-"})
    EXPECT_EQ(ask_for(range), "416 bytes */10") << range;
}

TEST(ByteRange, IsIgnoredWhereItIsntOneRangeOfBytes) {
  for (const char* range : {"", "bytes", "bytes=", "bytes=-", "bytes=4-2", "bytes=a-b", "bytes=1-2x", "bytes=+1-2",
                            "bytes=1", "lines=1-2", "bytes=0-1,3-4", "bytes=0-0,", "bytes=--1", "bytes= 1-2"})
    EXPECT_EQ(ask_for(range), "200 0123456789") << range;
  EXPECT_EQ(ask_for("bytes=2-4", "", true), "200 0123456789");  // HEAD
}

// RFC 9110, 13.1.5: by strong comparison.
TEST(ByteRange, HoldsForTheSameTagAlone) {
  EXPECT_EQ(ask_for("bytes=2-4", kTag), "206 bytes 2-4/10 234");
  for (const char* known : {"\"other\"", "W/\"tag\"", "*", "tag", "Wed, 21 Oct 2026 07:28:00 GMT"})
    EXPECT_EQ(ask_for("bytes=2-4", known), "200 0123456789") << known;
}

}  // namespace
}  // namespace tessera::server

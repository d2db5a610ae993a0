#include "client/http.h"

#include <gtest/gtest.h>

#include "client/failure.h"

namespace tessera::client {
namespace {

std::string round_trip(std::string_view url) {
  const auto address = parse_server_url(url);
  return address ? to_url(*address) : "nothing";
}

TEST(ServerUrl, ReadsHostAndPort) {
  EXPECT_EQ(round_trip("http://127.0.0.1:8080"), "http://127.0.0.1:8080");
  EXPECT_EQ(round_trip("http://render.example/"), "http://render.example:80");
  EXPECT_EQ(round_trip("http://[::1]:9000/"), "http://[::1]:9000");
  EXPECT_EQ(parse_server_url("http://[::1]:9000")->host, "::1");
  EXPECT_EQ(round_trip("https://render.example"), "https://render.example:443");
  EXPECT_EQ(round_trip("https://[::1]:9000/"), "https://[::1]:9000");
  EXPECT_FALSE(parse_server_url("http://a")->is_tls);
  EXPECT_TRUE(parse_server_url("https://a")->is_tls);
}

TEST(ServerUrl, RefusesWhatItCannotReach) {
  for (const char* url :
       {"", "127.0.0.1:8080", "https://", "HTTPS//a", "ftp://a", "http://", "http://:80", "http://a:", "http://a:b",
        "http://a:123456", "http://a/path", "http://user@a", "http://[::1", "http://[::1]9"})
    EXPECT_FALSE(parse_server_url(url)) << url;
}

TEST(PercentEncode, KeepsWhatIsUnreserved) {
  EXPECT_EQ(percent_encode("aZ09-._~:"), "aZ09-._~:");
  EXPECT_EQ(percent_encode("a/b?c d&\xC3\xA4"), "a%2Fb%3Fc%20d%26%C3%A4");
}

TEST(Exchange, SaysThatNobodyListens) {
  try {
    exchange({.host = "127.0.0.1", .port = "1"}, {.method = "GET", .target = "/"});
    FAIL() << "something listens on port 1";
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.kind(), Failure::Kind::unreachable);
    EXPECT_NE(std::string(failure.what()).find("http://127.0.0.1:1"), std::string::npos) << failure.what();
  }
}

TEST(Exchange, SaysThatNobodyIsTrusted) {
  try {
    exchange({.is_tls = true, .ca_file = "/no/such/file"}, {.method = "GET", .target = "/"});
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.kind(), Failure::Kind::local_file);
    EXPECT_NE(std::string(failure.what()).find("/no/such/file"), std::string::npos) << failure.what();
  }
}

TEST(Exchange, SaysThatTheFileIsMissing) {
  try {
    exchange({}, {.method = "PUT", .target = "/", .body = std::filesystem::path("/no/such/file")});
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.kind(), Failure::Kind::local_file);
  }
}

}  // namespace
}  // namespace tessera::client

#include "server/http/cross_site.h"

#include <map>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

using Headers = std::map<std::string, std::string>;

Request request_with(std::string method, Headers headers) {
  Request request;
  request.method = std::move(method);
  request.headers = std::move(headers);
  request.target = *parse_target("/v1/jobs");
  return request;
}

bool answers(const std::string& host, const std::string& local_address, const Config& config = {}) {
  return !refuse_host(config, request_with("GET", {{"host", host}}), local_address);
}

TEST(Host, IsTheAddressThatTheConnectionCameTo) {
  EXPECT_TRUE(answers("192.168.1.7:80", "192.168.1.7:8080"));
  EXPECT_TRUE(answers("192.168.1.7", "[::ffff:192.168.1.7]:8080"));
  EXPECT_TRUE(answers("[fe80::1]:8080", "[fe80::1%eth0]:8080"));
  EXPECT_FALSE(answers("192.168.1.8", "192.168.1.7:8080"));
  EXPECT_FALSE(answers("evil.example", "192.168.1.7:8080"));
}

TEST(Host, IsWhatTheServerIsCalled) {
  Config config;
  config.host = "0.0.0.0";
  config.host_names = {"Render.example.org", "[2001:DB8::7]"};
  EXPECT_TRUE(answers("0.0.0.0:8080", "127.0.0.1:8080", config));
  EXPECT_TRUE(answers("render.example.org.:443", "10.0.0.1:8080", config));
  EXPECT_TRUE(answers("[2001:db8:0::7]", "10.0.0.1:8080", config));
  EXPECT_FALSE(answers("example.org", "10.0.0.1:8080", config));
  const auto problem = refuse_host(config, request_with("GET", {{"host", "other.example:80"}}), "10.0.0.1:8080");
  ASSERT_TRUE(problem);
  EXPECT_EQ(problem->code, proto::ProblemCode::misdirected_request);
  EXPECT_NE(problem->detail.find("--host-name other.example."), std::string::npos) << problem->detail;
}

/// Whether a page's POST is refused.
bool is_refused(Headers headers, const Config& config = {}) {
  headers.emplace("host", "127.0.0.1:8080");
  return refuse_origin(config, request_with("POST", headers)).has_value();
}

TEST(Origin, OfAnotherPageIsRefused) {
  EXPECT_FALSE(is_refused({}));
  EXPECT_FALSE(is_refused({{"origin", "http://127.0.0.1:8080"}}));
  EXPECT_FALSE(is_refused({{"origin", "https://127.0.0.1:8080"}, {"sec-fetch-site", "same-origin"}}));
  EXPECT_FALSE(is_refused({{"sec-fetch-site", "none"}}));
  for (const char* origin : {"http://evil.example", "http://127.0.0.1", "http://127.0.0.1:3000", "null", "",
                             "http://127.0.0.1:8080, http://evil.example", "127.0.0.1:8080"})
    EXPECT_TRUE(is_refused({{"origin", origin}})) << origin;
  for (const char* site : {"cross-site", "same-site", "", "CROSS-SITE"})
    EXPECT_TRUE(is_refused({{"sec-fetch-site", site}})) << site;
  EXPECT_TRUE(is_refused({{"origin", "http://127.0.0.1:8080"}, {"sec-fetch-site", "cross-site"}}));
}

TEST(Origin, ThatIsNamedMay) {
  Config config;
  config.cors_origins = {"https://shop.example", "http://localhost:3000"};
  EXPECT_FALSE(is_refused({{"origin", "https://shop.example"}, {"sec-fetch-site", "cross-site"}}, config));
  EXPECT_TRUE(is_refused({{"origin", "http://shop.example"}}, config));
  EXPECT_TRUE(is_refused({{"origin", "https://shop.example.evil.example"}}, config));
  EXPECT_TRUE(is_refused({{"sec-fetch-site", "cross-site"}}, config));
}

TEST(Origin, ReadingIsLeftToTheBrowser) {
  EXPECT_FALSE(refuse_origin({}, request_with("GET", {{"host", "localhost"}, {"origin", "http://evil.example"}})));
}

}  // namespace
}  // namespace tessera::server

#include "server/http/request.h"

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

using Segments = std::vector<std::string>;

TEST(Target, IsSplitAndDecoded) {
  const auto target = parse_target("/v1/jobs/a%2Fb?limit=10&after=x%26y&flag");
  ASSERT_TRUE(target);
  EXPECT_EQ(target->segments, (Segments{"v1", "jobs", "a/b"}));
  ASSERT_EQ(target->query.size(), 3U);
  EXPECT_EQ(target->query[0], std::pair(std::string("limit"), std::string("10")));
  EXPECT_EQ(target->query[1].second, "x&y");
  EXPECT_EQ(target->query[2], std::pair(std::string("flag"), std::string()));
}

TEST(Target, KeepsEmptySegments) {
  EXPECT_EQ(parse_target("/")->segments, Segments{""});
  EXPECT_EQ(parse_target("/v1//jobs/")->segments, (Segments{"v1", "", "jobs", ""}));
  EXPECT_TRUE(parse_target("/a?")->query.empty());
}

TEST(Target, AbsoluteFormIsItsPath) {
  EXPECT_EQ(parse_target("http://host:80/livez?x=1")->segments, Segments{"livez"});
  EXPECT_EQ(parse_target("HTTP://host/livez")->segments, Segments{"livez"});
  EXPECT_EQ(parse_target("http://host")->segments, Segments{""});
  EXPECT_EQ(parse_target("http://host?a=b/c")->query[0].second, "b/c");
}

TEST(Target, SaysWhomTheRequestIsFor) {
  Request request;
  EXPECT_EQ(request.host(), std::nullopt);
  request.headers["host"] = "a";
  request.target = *parse_target("/livez");
  EXPECT_EQ(request.host(), "a");
  request.target = *parse_target("http://b:80/livez");
  EXPECT_EQ(request.host(), "b:80");
}

TEST(Target, RefusesWhatIsNone) {
  for (const char* text : {"", "*", "livez", "https://host/", "/%", "/%2", "/%zz", "/a?b=%1", "/a#b", "/a b",
                           "/\xC3\xA4", "/a|b", "/a?<", "http:///a", "http://u@host/a", "http://:80/"})
    EXPECT_FALSE(parse_target(text)) << text;
}

TEST(Request, FindsHeadersAndQueries) {
  Request request;
  request.headers["accept"] = "image/png";
  request.target = *parse_target("/?format=exr");
  EXPECT_EQ(request.header("accept"), "image/png");
  EXPECT_EQ(request.header("etag"), std::nullopt);
  EXPECT_EQ(request.query("format"), "exr");
  EXPECT_EQ(request.query("aov"), std::nullopt);
}

}  // namespace
}  // namespace tessera::server

#include "server/webhooks/webhook_target.h"

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

const WebhookRules kStrict{
    {"hooks.example.org", "Other.Example.org.:8443", "*.example.net", "127.0.0.1", "9.9.9.9", "[2001:db8::1]:444"},
    false};

bool is_taken(const WebhookRules& rules, const std::string& url) {
  const auto target = read_webhook(rules, url);
  if (!target) {
    EXPECT_EQ(target.problem().code, proto::ProblemCode::invalid_document) << url;
    EXPECT_EQ(target.problem().errors.at(0).pointer, "/webhook") << url;
  }
  return static_cast<bool>(target);
}

TEST(WebhookTarget, IsReadFromAUrl) {
  const auto plain = read_webhook(kStrict, "https://Hooks.Example.ORG");
  ASSERT_TRUE(plain);
  EXPECT_TRUE(plain->is_tls);
  EXPECT_EQ(plain->host, "hooks.example.org");
  EXPECT_EQ(plain->port, 443);
  EXPECT_EQ(plain->path, "/");
  EXPECT_EQ(plain->authority(), "hooks.example.org");
  const auto full = read_webhook(kStrict, "https://other.example.org:8443/a%20b/c?d=e&f=g");
  ASSERT_TRUE(full);
  EXPECT_EQ(full->path, "/a%20b/c?d=e&f=g");
  EXPECT_EQ(full->authority(), "other.example.org:8443");
  EXPECT_EQ(read_webhook(kStrict, "https://hooks.example.org?a")->path, "/?a");
  const WebhookRules open{{"[2001:db8::1]:444", "127.0.0.1"}, true};
  EXPECT_EQ(read_webhook(open, "https://[2001:DB8:0::1]:444/")->authority(), "[2001:db8::1]:444");
  const auto without_tls = read_webhook(open, "http://127.0.0.1/");
  ASSERT_TRUE(without_tls);
  EXPECT_EQ(without_tls->port, 80);
  EXPECT_FALSE(without_tls->is_tls);
}

TEST(WebhookTarget, OnlyHostsThatAreNamedAreTaken) {
  for (const char* url :
       {"https://hooks.example.org/", "https://hooks.example.org:443/", "https://hooks.example.org./",
        "https://other.example.org:8443", "https://a.example.net/", "https://a.b.example.net/", "https://9.9.9.9/"})
    EXPECT_TRUE(is_taken(kStrict, url)) << url;
  for (const char* url :
       {"https://example.org/", "https://a.hooks.example.org/", "https://hooks.example.org.evil.example/",
        "https://hooks.example.org:444/", "https://other.example.org/", "https://example.net/",
        "https://.example.net/x", "https://a.example.net:444/", "https://notexample.net/"})
    EXPECT_FALSE(is_taken(kStrict, url)) << url;
  EXPECT_FALSE(is_taken({}, "https://hooks.example.org/"));
}

TEST(WebhookTarget, WhatIsNoUrlOrAStrangeOneIsRefused) {
  for (const char* url : {"",
                          "hooks.example.org",
                          "//hooks.example.org/",
                          "ftp://hooks.example.org/",
                          "HTTPS//hooks.example.org",
                          "https://",
                          "https:///path",
                          "https://hooks.example.org:0/",
                          "https://hooks.example.org:65536/",
                          "https://hooks.example.org:/",
                          "https://hooks.example.org:443x/",
                          "https://hooks.example.org/a b",
                          "https://hooks.example.org/#part",
                          "https://hooks.example.org/\r\nX: y",
                          "https://hooks.example.org\\@evil/",
                          "https://user@hooks.example.org/",
                          "https://user:word@hooks.example.org/",
                          "https://hooks%2eexample.org/",
                          "https://a%00.example.net/",
                          "https://[::1/",
                          "https://[::1]x/",
                          "https://h\xc3\xb6oks.example.net/",
                          "http://hooks.example.org/"})
    EXPECT_FALSE(is_taken(kStrict, url)) << url;
}

TEST(WebhookTarget, AddressesOfNoInternetAreRefusedUnlessAllowed) {
  for (const char* url : {"https://127.0.0.1/", "https://[::ffff:127.0.0.1]/", "https://[2001:db8::1]:444/"}) {
    EXPECT_FALSE(is_taken(kStrict, url)) << url;
    EXPECT_TRUE(is_taken({kStrict.hosts, true}, url)) << url;
  }
}

TEST(WebhookTarget, HostsAreNamedAsInUrls) {
  for (const char* text : {"a", "a.b:1", "*.a.b", "*.a:65535", "127.0.0.1", "[::1]", "[::1]:8080", "A.B."})
    EXPECT_TRUE(is_webhook_host(text)) << text;
  for (const char* text : {"", "*", "*.", "a.*", "https://a", "a/", "a:", "a:0", "a:65536", "::1", "a b", "a@b", "a,b"})
    EXPECT_FALSE(is_webhook_host(text)) << text;
  EXPECT_EQ(host_of_webhook("https://a.b:8443/path?x=y"), "a.b:8443");
  EXPECT_EQ(host_of_webhook("http://a?x"), "a");
}

}  // namespace
}  // namespace tessera::server

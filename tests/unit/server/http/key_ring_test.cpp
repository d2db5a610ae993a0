#include "server/http/key_ring.h"

#include <chrono>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {

using proto::Key;
using proto::Scope;

std::string add_key(
    const TemporaryFolder& folder, const std::function<void(Key&)>& change = [](Key&) {}) {
  Key key;
  key.owner = "alice";
  key.scopes = {Scope::read};
  key.created = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  std::string token = proto::make_token(key);
  change(key);
  proto::change_keys(folder.path(), [&](std::vector<Key>& keys) { keys.push_back(key); });
  return token;
}

TEST(KeyRing, WithoutKeysEverybodyMayDoEverything) {
  const TemporaryFolder folder;
  const KeyRing ring(folder.path(), false);
  EXPECT_TRUE(ring.is_open());
  const auto who = ring.find("Bearer tsk_what_ever");
  ASSERT_TRUE(who);
  EXPECT_EQ(who->owner, "");
  for (const Scope scope : {Scope::read, Scope::submit, Scope::admin}) EXPECT_TRUE(who->may(scope));
  EXPECT_FALSE(KeyRing(folder.path(), true).is_open());
  EXPECT_FALSE(KeyRing(folder.path(), true).find(std::nullopt));
}

TEST(KeyRing, LetsInWhoShowsAKey) {
  const TemporaryFolder folder;
  const std::string token = add_key(folder);
  const KeyRing ring(folder.path(), false);
  EXPECT_FALSE(ring.is_open());
  for (const std::string& header : {"Bearer " + token, "bearer " + token, "BEARER   " + token + " "}) {
    const auto who = ring.find(header);
    ASSERT_TRUE(who) << header;
    EXPECT_EQ(who->owner, "alice");
    EXPECT_TRUE(who->may(Scope::read));
    EXPECT_FALSE(who->may(Scope::submit));
    EXPECT_TRUE(who->sees("alice"));
    EXPECT_FALSE(who->sees("bob"));
    EXPECT_FALSE(who->sees(""));
  }
  std::string other = token;
  other.back() = other.back() == 'a' ? 'b' : 'a';
  for (const std::string& header :
       {std::string(), token, "Basic " + token, std::string("Bearer"), "Bearer " + other, "Bearer " + token + "a",
        "Bearer " + token + ", Bearer " + token, "Bearer " + token.substr(0, token.size() - 1), "Bearer\t" + token}) {
    const auto who = ring.find(header);
    ASSERT_FALSE(who) << header;
    EXPECT_EQ(who.problem().code, proto::ProblemCode::unauthorized);
    EXPECT_EQ(who.problem().detail.find(token.substr(20)), std::string::npos) << "a secret isn't repeated";
  }
  EXPECT_FALSE(ring.find(std::nullopt));
}

TEST(KeyRing, AnAdminMayDoEverything) {
  const TemporaryFolder folder;
  const std::string token = add_key(folder, [](Key& key) { key.scopes = {Scope::admin}; });
  const auto who = KeyRing(folder.path(), false).find("Bearer " + token);
  ASSERT_TRUE(who);
  EXPECT_TRUE(who->may(Scope::submit));
  EXPECT_TRUE(who->sees("bob"));
}

TEST(KeyRing, KeysEnd) {
  const TemporaryFolder folder;
  const std::string revoked = add_key(folder, [](Key& key) { key.revoked = key.created; });
  const std::string expired = add_key(folder, [](Key& key) { key.expires = key.created; });
  const std::string valid = add_key(folder, [](Key& key) { key.expires = key.created + std::chrono::hours(1); });
  const KeyRing ring(folder.path(), false);
  EXPECT_NE(ring.find("Bearer " + revoked).problem().detail.find("revoked"), std::string::npos);
  EXPECT_NE(ring.find("Bearer " + expired).problem().detail.find("expired"), std::string::npos);
  EXPECT_TRUE(ring.find("Bearer " + valid));
}

TEST(KeyRing, IsReadAgainWhenTold) {
  const TemporaryFolder folder;
  KeyRing ring(folder.path(), false);
  const std::string token = add_key(folder);
  EXPECT_TRUE(ring.is_open());
  EXPECT_EQ(ring.reload(), 1U);
  EXPECT_FALSE(ring.is_open());
  EXPECT_TRUE(ring.find("Bearer " + token));
  folder.write("keys.json", "{");
  EXPECT_THROW(ring.reload(), std::runtime_error);
  EXPECT_TRUE(ring.find("Bearer " + token)) << "they stay as they were";
  std::filesystem::remove(folder.path() / "keys.json");
  EXPECT_EQ(ring.reload(), 0U);
  EXPECT_FALSE(ring.is_open()) << "a file that is gone lets nobody in";
  EXPECT_FALSE(ring.find("Bearer " + token));
}

}  // namespace
}  // namespace tessera::server

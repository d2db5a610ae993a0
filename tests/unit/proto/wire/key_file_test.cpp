#include "proto/wire/key_file.h"

#include <chrono>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/temporary_folder.h"

namespace tessera::proto {
namespace {

namespace fs = std::filesystem;

class KeyFile : public FolderTest {
 protected:
  void add(const Key& key) const {
    change_keys(folder_, [&](std::vector<Key>& keys) { keys.push_back(key); });
  }
  /// What is said of a file.
  std::string error_of(const std::string& text) const {
    std::ofstream(key_file(folder_)) << text;
    try {
      read_keys(folder_);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }
};

Key key_of(const std::string& owner) {
  Key key;
  key.owner = owner;
  key.name = "for \"tests\"";
  key.scopes = {Scope::submit, Scope::read};
  key.created = Key::Time(std::chrono::seconds(1'700'000'000));
  return key;
}

TEST(KeyToken, IsTheKeysAloneAndNeverTheSame) {
  std::set<std::string> tokens;
  for (int i = 0; i < 100; ++i) {
    Key key;
    const std::string token = make_token(key);
    EXPECT_TRUE(tokens.insert(token).second);
    EXPECT_EQ(id_of_token(token), key.id);
    EXPECT_TRUE(fits(key.token_hash, token));
    EXPECT_EQ(key.token_hash.find(token), std::string::npos);
    for (std::size_t at = 0; at < token.size(); ++at) {
      std::string other = token;
      other[at] = other[at] == 'a' ? 'b' : 'a';
      EXPECT_FALSE(fits(key.token_hash, other)) << at;
    }
    EXPECT_FALSE(fits(key.token_hash, token + "a"));
    EXPECT_FALSE(fits(key.token_hash, key.token_hash)) << "what is kept is no key";
  }
}

TEST(KeyToken, HasAForm) {
  for (const char* text : {"", "tsk_", "tsk_abc_def", "Bearer"}) EXPECT_EQ(id_of_token(text), "") << text;
  Key key;
  std::string token = make_token(key);
  EXPECT_EQ(id_of_token(token.substr(1)), "");
  EXPECT_EQ(id_of_token(token + 'a'), "");
  token[16] = 'a';
  EXPECT_EQ(id_of_token(token), "");
}

TEST(KeyOwner, NamesAFolder) {
  for (const char* name : {"a", "alice@example.org", "A-1_b.c"}) EXPECT_TRUE(is_owner_name(name)) << name;
  for (const char* name : {"", ".", "..", "a/b", "a b", "-a", "\xC3\xA4", "a\n"}) EXPECT_FALSE(is_owner_name(name));
  EXPECT_FALSE(is_owner_name(std::string(65, 'a')));
}

TEST_F(KeyFile, GivesBackWhatWasWritten) {
  EXPECT_TRUE(read_keys(folder_).empty());
  Key key = key_of("alice");
  make_token(key);
  key.expires = key.created + std::chrono::days(1);
  key.limits = {2.5, 7, 3, 18'000'000'000'000'000'000ULL, 5};
  add(key);
  Key other = key_of("bob");
  make_token(other);
  other.revoked = other.created;
  add(other);
  const auto keys = read_keys(folder_);
  ASSERT_EQ(keys.size(), 2U);
  EXPECT_EQ(keys[0].id, key.id);
  EXPECT_EQ(keys[0].owner, "alice");
  EXPECT_EQ(keys[0].name, key.name);
  EXPECT_EQ(keys[0].scopes, key.scopes);
  EXPECT_EQ(keys[0].token_hash, key.token_hash);
  EXPECT_EQ(keys[0].created, key.created);
  EXPECT_EQ(keys[0].expires, key.expires);
  EXPECT_EQ(keys[0].revoked, std::nullopt);
  EXPECT_EQ(keys[0].limits.requests_per_second, 2.5);
  EXPECT_EQ(keys[0].limits.burst, 7U);
  EXPECT_EQ(keys[0].limits.unfinished_jobs, 3U);
  EXPECT_EQ(keys[0].limits.samples_per_hour, 18'000'000'000'000'000'000ULL);
  EXPECT_EQ(keys[0].limits.stored_bytes, 5U);
  EXPECT_TRUE(keys[0].is_valid(key.created));
  EXPECT_FALSE(keys[0].is_valid(*key.expires));
  EXPECT_FALSE(keys[1].is_valid(other.created));
  EXPECT_EQ(keys[1].limits.burst, std::nullopt);
}

TEST_F(KeyFile, IsReadableForItsOwnerAlone) {
  fs::remove(folder_);
  ::umask(0);
  add(key_of("alice"));
  struct stat file {
  }, folder{};
  ASSERT_EQ(::stat(key_file(folder_).c_str(), &file), 0);
  ASSERT_EQ(::stat(folder_.c_str(), &folder), 0);
  EXPECT_EQ(file.st_mode & 0777, 0600U);
  EXPECT_EQ(folder.st_mode & 0777, 0700U);
}

TEST_F(KeyFile, IsLeftAsItIsByWhoFails) {
  Key key = key_of("alice");
  make_token(key);
  add(key);
  EXPECT_THROW(change_keys(folder_,
                           [](std::vector<Key>& keys) {
                             keys.clear();
                             throw std::runtime_error("no");
                           }),
               std::runtime_error);
  EXPECT_EQ(read_keys(folder_).size(), 1U);
}

TEST_F(KeyFile, LosesNoKeyOfSeveralWriters) {
  std::vector<std::jthread> writers;
  for (int i = 0; i < 4; ++i)
    writers.emplace_back([this] {
      for (int n = 0; n < 10; ++n) {
        Key key = key_of("alice");
        make_token(key);
        add(key);
      }
    });
  writers.clear();
  EXPECT_EQ(read_keys(folder_).size(), 40U);
}

TEST_F(KeyFile, SaysWhatIsWrongWithIt) {
  const std::string begin = R"({"version": 1, "keys": [{"id": "a", "owner": "b", "name": "", "scopes": ["read"], )";
  const std::string hash = R"("token_hash": "sha256:)" + std::string(64, '0') + R"(", )";
  const std::string created = R"("created": "2026-11-30T12:00:00Z")";
  EXPECT_EQ(error_of(begin + hash + created + "}]}"), "");
  const auto expect = [&](const std::string& text, const std::string& place) {
    EXPECT_NE(error_of(text).find(place + ": "), std::string::npos) << error_of(text);
  };
  EXPECT_NE(error_of("{").find("isn't JSON"), std::string::npos);
  expect("[]", "keys.json");
  expect(R"({"version": 2, "keys": []})", "/version");
  expect(R"({"version": 1, "keys": [], "more": 1})", "/more");
  expect(begin + created + "}]}", "/keys/0/token_hash");
  expect(begin + hash + R"("created": "2026-11-31T12:00:00Z"}]})", "/keys/0/created");
  expect(begin + hash + R"("created": "yesterday"}]})", "/keys/0/created");
  expect(begin + hash + created + R"(, "limits": {"burst": -1}}]})", "/keys/0/limits/burst");
  expect(begin + hash + created + R"(, "limits": {"burst": 5000000000}}]})", "/keys/0/limits/burst");
  expect(begin + hash + created + R"(, "limits": {"bursts": 1}}]})", "/keys/0/limits/bursts");
  expect(begin + hash + created + R"(, "expired": 1}]})", "/keys/0/expired");
  const std::string key = begin.substr(begin.find("[{") + 1) + hash + created + '}';
  expect(R"({"version": 1, "keys": [)" + key + ',' + key + "]}", "/keys/1/id");
  std::string owner = begin + hash + created + "}]}";
  owner.replace(owner.find("\"b\""), 3, "\"../b\"");
  expect(owner, "/keys/0/owner");
  std::string scope = begin + hash + created + "}]}";
  scope.replace(scope.find("\"read\""), 6, "\"write\"");
  expect(scope, "/keys/0/scopes");
}

}  // namespace
}  // namespace tessera::proto

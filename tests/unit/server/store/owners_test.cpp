#include "server/store/owners.h"

#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {

std::string hash_of(char digit) { return "sha256:" + std::string(64, digit); }

TEST(Owners, KnowWhoHasWhat) {
  const TemporaryFolder folder;
  Owners owners(folder.path() / "owners");
  EXPECT_FALSE(owners.has("alice", hash_of('a')));
  owners.add("alice", hash_of('a'), 10);
  owners.add("alice", hash_of('b'), 5);
  owners.add("alice", hash_of('a'), 10);
  owners.add("bob", hash_of('b'), 5);
  EXPECT_TRUE(owners.has("alice", hash_of('a')));
  EXPECT_FALSE(owners.has("bob", hash_of('a')));
  EXPECT_TRUE(owners.has("bob", hash_of('b')));
  EXPECT_EQ(owners.bytes_of("alice"), 15U);
  EXPECT_EQ(owners.bytes_of("bob"), 5U);
  EXPECT_EQ(owners.bytes_of("carol"), 0U);
  for (const char* no_hash : {"", "sha256:", "sha256:a", "a"}) {
    EXPECT_FALSE(owners.has("alice", no_hash));
    EXPECT_EQ(owners.bytes_of("alice", no_hash), 0U);
  }
  EXPECT_EQ(owners.bytes_of("alice", hash_of('a')), 10U);
}

TEST(Owners, OutliveTheDaemon) {
  const TemporaryFolder folder;
  {
    Owners owners(folder.path());
    owners.add("alice", hash_of('a'), 10);
    owners.add("alice", hash_of('b'), 7);
  }
  folder.write("alice/notes", "of somebody else");
  folder.write("alice/" + std::string(64, 'c') + ".12x", "");
  const Owners owners(folder.path());
  EXPECT_TRUE(owners.has("alice", hash_of('a')));
  EXPECT_FALSE(owners.has("alice", hash_of('c')));
  EXPECT_EQ(owners.bytes_of("alice"), 17U);
}

TEST(Owners, WhatExpiresIsNobodysUnlessItIsThereAgain) {
  const TemporaryFolder folder;
  Owners owners(folder.path());
  owners.add("alice", hash_of('a'), 10);
  owners.add("bob", hash_of('a'), 10);
  owners.expire(hash_of('a'), [] { return true; });
  EXPECT_EQ(owners.bytes_of("alice"), 10U) << "it was put again before its owners were told";
  owners.expire(hash_of('a'), [] { return false; });
  EXPECT_EQ(owners.bytes_of("alice") + owners.bytes_of("bob"), 0U);
  EXPECT_TRUE(owners.has("alice", hash_of('a')));
  EXPECT_EQ(Owners(folder.path()).bytes_of("alice"), 0U);
  owners.add("bob", hash_of('a'), 10);
  EXPECT_FALSE(owners.has_others("bob", hash_of('a'))) << "only those whose bytes it once was";
  EXPECT_TRUE(owners.has_others("alice", hash_of('a')));
}

TEST(Owners, NobodyHasNothing) {
  const TemporaryFolder folder;
  Owners owners(folder.path());
  owners.add("", hash_of('a'), 10);
  EXPECT_FALSE(owners.has("", hash_of('a')));
  EXPECT_EQ(folder.file_count(), 0U);
}

}  // namespace
}  // namespace tessera::server

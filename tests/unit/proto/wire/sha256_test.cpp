#include "proto/wire/sha256.h"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

namespace tessera::proto {
namespace {

// FIPS 180-2, appendix B.
constexpr std::string_view kAbc = "sha256:ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
constexpr std::string_view kMillionAs = "sha256:cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0";

TEST(Sha256, KnownAnswers) {
  EXPECT_EQ(content_hash("abc"), kAbc);
  EXPECT_EQ(content_hash(""), "sha256:e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  Sha256 hash;
  for (int i = 0; i < 1000; ++i) hash.update(std::string(1000, 'a'));
  EXPECT_EQ(hash.finish(), kMillionAs);
}

TEST(Sha256, FilesOfMoreThanAChunk) {
  const auto path = std::filesystem::path(testing::TempDir()) / "tessera_sha256_test";
  std::ofstream(path, std::ios::binary) << std::string(1'000'000, 'a');
  EXPECT_EQ(hash_file(path), kMillionAs);
  std::filesystem::remove(path);
  EXPECT_EQ(hash_file(path), std::nullopt);
  EXPECT_EQ(hash_file(testing::TempDir()), std::nullopt) << "a folder has no content";
}

TEST(Sha256, OnlyTheWireFormIsAContentHash) {
  const std::string good(kAbc);
  EXPECT_TRUE(is_content_hash(good));
  EXPECT_FALSE(is_content_hash(""));
  EXPECT_FALSE(is_content_hash(good.substr(7)));
  EXPECT_FALSE(is_content_hash(good + "0"));
  EXPECT_FALSE(is_content_hash(good.substr(0, good.size() - 1)));
  EXPECT_FALSE(is_content_hash("sha256:" + std::string(64, 'A')));
  EXPECT_FALSE(is_content_hash("sha256:" + std::string(63, 'a') + "/"));
}

}  // namespace
}  // namespace tessera::proto

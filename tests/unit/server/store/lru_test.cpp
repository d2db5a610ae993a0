#include "server/store/lru.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

/// What entries of a one-letter name take beside their values.
constexpr std::uint64_t with_overhead(std::uint64_t bytes, std::uint64_t entries) {
  return bytes + entries * Lru<std::string>::overhead("a");
}

std::vector<std::string> values(const Lru<std::string>::Evicted& evicted) {
  std::vector<std::string> values;
  for (const auto& entry : evicted) values.push_back(entry.value);
  return values;
}

TEST(Lru, DropsWhatWasUsedLongestAgo) {
  Lru<std::string> cache(with_overhead(10, 2));
  Lru<std::string>::Evicted evicted;
  cache.put("a", "A", 4, evicted);
  cache.put("b", "B", 4, evicted);
  EXPECT_EQ(cache.find("a"), "A");
  cache.put("c", "C", 4, evicted);
  EXPECT_EQ(values(evicted), std::vector<std::string>{"B"});
  EXPECT_EQ(cache.find("b"), std::nullopt);
  EXPECT_EQ(cache.find("a"), "A");
  EXPECT_EQ(cache.bytes(), with_overhead(8, 2));
}

TEST(Lru, DropsAsManyAsItTakes) {
  Lru<std::string> cache(with_overhead(10, 5));
  Lru<std::string>::Evicted evicted;
  for (const char* key : {"a", "b", "c", "d", "e"}) cache.put(key, key, 2, evicted);
  EXPECT_TRUE(evicted.empty());
  cache.put("l", "large", with_overhead(9, 4), evicted);
  EXPECT_EQ(values(evicted), (std::vector<std::string>{"a", "b", "c", "d", "e"}));
  EXPECT_EQ(cache.bytes(), with_overhead(9, 5));
}

TEST(Lru, ReplacingCountsOnce) {
  Lru<std::string> cache(with_overhead(10, 1));
  Lru<std::string>::Evicted evicted;
  cache.put("a", "1", 6, evicted);
  cache.put("a", "2", 7, evicted);
  EXPECT_EQ(cache.find("a"), "2");
  EXPECT_EQ(cache.bytes(), with_overhead(7, 1));
}

TEST(Lru, WhatIsLargerThanAllIsNotKept) {
  Lru<std::string> cache(with_overhead(10, 1));
  Lru<std::string>::Evicted evicted;
  cache.put("a", "1", 11, evicted);
  EXPECT_EQ(cache.find("a"), std::nullopt);
  EXPECT_EQ(cache.bytes(), 0U);
}

/// Many small values with long names take more than the values.
TEST(Lru, CountsNames) {
  Lru<std::string> cache(100'000);
  Lru<std::string>::Evicted evicted;
  for (int i = 0; i < 1000; ++i) cache.put(std::string(1000, 'x') + std::to_string(i), "", 0, evicted);
  EXPECT_GE(evicted.size(), 900U);
}

TEST(Lru, DropsByPrefix) {
  Lru<std::string> cache(100'000);
  Lru<std::string>::Evicted evicted;
  for (const char* key : {"a", "ab", "abc", "b", "B"}) cache.put(key, key, 1, evicted);
  cache.drop_all("ab", evicted);
  EXPECT_EQ(values(evicted), (std::vector<std::string>{"ab", "abc"}));
  EXPECT_TRUE(cache.find("a") && cache.find("b") && cache.find("B"));
  cache.drop_all("", evicted);
  EXPECT_EQ(cache.bytes(), 0U);
}

}  // namespace
}  // namespace tessera::server

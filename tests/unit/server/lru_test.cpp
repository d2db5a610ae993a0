#include "server/lru.h"

#include <list>
#include <string>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

TEST(Lru, DropsWhatWasUsedLongestAgo) {
  Lru<std::string> cache(10);
  std::list<std::string> evicted;
  cache.put("a", "A", 4, evicted);
  cache.put("b", "B", 4, evicted);
  EXPECT_EQ(cache.find("a"), "A");
  cache.put("c", "C", 4, evicted);
  EXPECT_EQ(evicted, std::list<std::string>{"B"});
  EXPECT_EQ(cache.find("b"), std::nullopt);
  EXPECT_EQ(cache.find("a"), "A");
  EXPECT_EQ(cache.bytes(), 8U);
}

TEST(Lru, DropsAsManyAsItTakes) {
  Lru<int> cache(10);
  std::list<int> evicted;
  for (int i = 0; i < 5; ++i) cache.put(std::to_string(i), i, 2, evicted);
  cache.put("large", 9, 9, evicted);
  EXPECT_EQ(evicted, (std::list<int>{0, 1, 2, 3, 4}));
  EXPECT_EQ(cache.bytes(), 9U);
}

TEST(Lru, ReplacingCountsOnce) {
  Lru<int> cache(10);
  std::list<int> evicted;
  cache.put("a", 1, 6, evicted);
  cache.put("a", 2, 7, evicted);
  EXPECT_EQ(cache.find("a"), 2);
  EXPECT_EQ(cache.bytes(), 7U);
}

TEST(Lru, WhatIsLargerThanAllIsNotKept) {
  Lru<int> cache(10);
  std::list<int> evicted;
  cache.put("a", 1, 11, evicted);
  EXPECT_EQ(cache.find("a"), std::nullopt);
  EXPECT_EQ(cache.bytes(), 0U);
}

}  // namespace
}  // namespace tessera::server

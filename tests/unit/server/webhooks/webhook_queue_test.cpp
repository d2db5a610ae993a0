#include "server/webhooks/webhook_queue.h"

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

using namespace std::chrono_literals;

constexpr WebhookQueue::Time kStart{};

/// The job that is taken; empty where none is to be.
std::string taken(WebhookQueue& queue, WebhookQueue::Time now) {
  const std::string* const job = queue.take(now);
  return job ? *job : "";
}

TEST(WebhookQueue, GivesWhatIsDueInOrder) {
  WebhookQueue queue(8);
  EXPECT_EQ(queue.next(), std::nullopt);
  queue.add("late", "a", kStart + 9s);
  queue.add("soon", "a", kStart + 5s);
  EXPECT_EQ(queue.next(), kStart + 5s);
  EXPECT_EQ(taken(queue, kStart + 4s), "");
  EXPECT_EQ(queue.due(kStart + 4s), 0U);
  EXPECT_EQ(taken(queue, kStart + 5s), "soon");
  EXPECT_EQ(queue.due(kStart + 5s), 1U) << "it is on its way";
  EXPECT_EQ(queue.next(), kStart + 9s);
  EXPECT_EQ(taken(queue, kStart + 5s), "");
  EXPECT_EQ(taken(queue, kStart + 9s), "late");
  EXPECT_EQ(queue.size(), 2U);
  queue.done("late");
  queue.done("soon");
  EXPECT_EQ(queue.size(), 0U);
}

TEST(WebhookQueue, HasEachJobOnce) {
  WebhookQueue queue(8);
  queue.add("job", "a", kStart);
  queue.add("job", "a", kStart + 1s);
  EXPECT_EQ(taken(queue, kStart + 2s), "job");
  queue.add("job", "a", kStart);
  EXPECT_EQ(taken(queue, kStart + 2s), "") << "it is on its way";
  queue.done("job");
  queue.add("job", "a", kStart);
  EXPECT_EQ(taken(queue, kStart), "job");
}

TEST(WebhookQueue, WhatIsPutBackIsDueLater) {
  WebhookQueue queue(1);
  queue.add("first", "a", kStart);
  queue.add("second", "a", kStart + 1s);
  EXPECT_EQ(taken(queue, kStart), "first");
  queue.put_back("first", kStart + 2s);
  EXPECT_EQ(queue.next(), kStart + 1s);
  EXPECT_EQ(taken(queue, kStart + 2s), "second");
  queue.done("second");
  EXPECT_EQ(taken(queue, kStart + 2s), "first");
  EXPECT_EQ(queue.size(), 1U);
}

TEST(WebhookQueue, ALaneHoldsUpNoOther) {
  WebhookQueue queue(2);
  for (const char* job : {"1", "2", "3"}) queue.add(job, "busy", kStart);
  queue.add("4", "other", kStart + 1s);
  queue.add("5", "other", kStart + 1s);
  EXPECT_EQ(taken(queue, kStart + 1s), "1") << "due longest";
  EXPECT_EQ(taken(queue, kStart + 1s), "4") << "its lane has none on their way";
  EXPECT_EQ(taken(queue, kStart + 1s), "2");
  EXPECT_EQ(taken(queue, kStart + 1s), "5");
  EXPECT_EQ(taken(queue, kStart + 1s), "") << "two at most";
  EXPECT_EQ(queue.next(), std::nullopt) << "time alone doesn't change that";
  queue.done("1");
  EXPECT_EQ(taken(queue, kStart + 1s), "3");
}

}  // namespace
}  // namespace tessera::server

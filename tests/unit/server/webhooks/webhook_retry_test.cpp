#include "server/webhooks/webhook_retry.h"

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

using namespace std::chrono_literals;
using proto::WebhookState;

TEST(WebhookRetry, AnyAnswerOf2xxIsADelivery) {
  for (const unsigned status : {200U, 202U, 204U, 299U}) {
    const auto tried = what_follows({status, {}, 5s}, 3, 0s, 0.5);
    EXPECT_EQ(tried.state, WebhookState::delivered);
    EXPECT_EQ(tried.error, "");
  }
}

TEST(WebhookRetry, AllElseIsTriedAgainButWhoIsGone) {
  for (const unsigned status : {301U, 307U, 400U, 404U, 429U, 500U, 503U}) {
    const auto tried = what_follows({status}, 0, 0s, 0.5);
    EXPECT_EQ(tried.state, WebhookState::pending) << status;
    EXPECT_EQ(tried.error, "it answered " + std::to_string(status));
  }
  EXPECT_EQ(what_follows({0, "no answer in time"}, 0, 0s, 0.5).error, "no answer in time");
  EXPECT_EQ(what_follows({410}, 0, 0s, 0.5).state, WebhookState::failed);
}

TEST(WebhookRetry, TheDelaysGrowAndEndAfterAboutADay) {
  std::chrono::steady_clock::duration all{}, before{};
  std::uint32_t tries = 0;
  for (auto tried = what_follows({500}, 0, 0s, 0.5); tried.state == WebhookState::pending;
       tried = what_follows({500}, ++tries, all, 0.5)) {
    EXPECT_GT(tried.delay, before);
    before = tried.delay;
    all += tried.delay;
  }
  EXPECT_EQ(what_follows({500}, 0, 0s, 0.5).delay, 5s);
  EXPECT_EQ(what_follows({500}, 1, 6s, 0.5).delay, 30s);
  EXPECT_EQ(tries, 10U);
  EXPECT_GT(all, 20h);
  EXPECT_LT(all, 28h);
}

TEST(WebhookRetry, NotAllComeBackAtOnce) {
  EXPECT_EQ(what_follows({500}, 0, 0s, 0).delay, 4s);
  EXPECT_EQ(what_follows({500}, 0, 0s, 1).delay, 6s);
}

TEST(WebhookRetry, AReceiverSaysWhenWithinBounds) {
  EXPECT_EQ(what_follows({503, {}, 90s}, 0, 0s, 0.5).delay, 90s);
  EXPECT_EQ(what_follows({429, {}, 0s}, 4, 1h, 0.5).delay, 1s);
  EXPECT_EQ(what_follows({503, {}, 1000h}, 4, 1h, 0.5).delay, 6h);
  EXPECT_EQ(what_follows({503, {}, 90s}, 3, 25h, 0.5).state, WebhookState::failed);
}

TEST(WebhookRetry, OneThatAsksToBeTriedSoonIsTriedForADayAllTheSame) {
  std::chrono::steady_clock::duration all{};
  std::uint32_t tries = 0;
  for (auto tried = what_follows({503, {}, 1s}, 0, 0s, 0.5); tried.state == WebhookState::pending;
       tried = what_follows({503, {}, 1s}, ++tries, all, 0.5)) {
    ASSERT_LT(tries, 30U);
    all += tried.delay;
  }
  EXPECT_GT(all, 20h);
}

}  // namespace
}  // namespace tessera::server

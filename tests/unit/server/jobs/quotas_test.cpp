#include "server/jobs/quotas.h"

#include <chrono>
#include <cstdint>
#include <optional>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

using std::chrono::milliseconds, std::chrono::minutes, std::chrono::seconds;

constexpr Quotas::Clock::time_point kStart{std::chrono::hours(1)};

proto::Key a_key() {
  proto::Key key;
  key.id = "a";
  return key;
}

proto::Key key_with_requests(double per_second, std::optional<std::uint32_t> burst = std::nullopt) {
  proto::Key key = a_key();
  key.limits.requests_per_second = per_second;
  key.limits.burst = burst;
  return key;
}

TEST(Quotas, WithoutLimitsThereAreNone) {
  Quotas quotas;
  const proto::Key key = a_key();
  for (int i = 0; i < 1000; ++i) ASSERT_FALSE(quotas.take_request(key, kStart));
  EXPECT_FALSE(quotas.take_samples(key, ~0ULL, kStart));
  EXPECT_FALSE(quotas.requests(key, kStart));
}

TEST(Quotas, RequestsComeBackAtTheirRate) {
  Quotas quotas;
  const proto::Key key = key_with_requests(2, 3);
  for (unsigned left = 3; left > 0; --left) {
    EXPECT_EQ(quotas.requests(key, kStart)->remaining, left);
    EXPECT_FALSE(quotas.take_request(key, kStart));
  }
  auto refused = quotas.take_request(key, kStart);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, proto::ProblemCode::quota_exceeded);
  EXPECT_EQ(refused->retry_after, 1U);
  EXPECT_EQ(quotas.requests(key, kStart)->limit, 3U);
  EXPECT_EQ(quotas.requests(key, kStart)->to_limit, seconds(2));  // 1.5
  EXPECT_TRUE(quotas.take_request(key, kStart + milliseconds(490)));
  EXPECT_FALSE(quotas.take_request(key, kStart + milliseconds(510)));
  EXPECT_TRUE(quotas.take_request(key, kStart + milliseconds(520)));
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(quotas.take_request(key, kStart + minutes(1)));
  EXPECT_TRUE(quotas.take_request(key, kStart + minutes(1))) << "no more are saved up than the burst";
}

TEST(Quotas, ABurstIsASecondsRequests) {
  Quotas quotas;
  EXPECT_EQ(quotas.requests(key_with_requests(10), kStart)->limit, 10U);
  const proto::Key rare = key_with_requests(0.1);
  EXPECT_EQ(quotas.requests(rare, kStart)->limit, 1U);
  EXPECT_FALSE(quotas.take_request(rare, kStart));
  EXPECT_EQ(quotas.take_request(rare, kStart)->retry_after, 10U);
}

TEST(Quotas, KeysHaveTheirOwn) {
  Quotas quotas;
  proto::Key key = key_with_requests(1);
  EXPECT_FALSE(quotas.take_request(key, kStart));
  EXPECT_TRUE(quotas.take_request(key, kStart));
  key.id = "b";
  EXPECT_FALSE(quotas.take_request(key, kStart));
}

TEST(Quotas, SamplesComeBackOverTheHour) {
  Quotas quotas;
  proto::Key key = a_key();
  key.limits.samples_per_hour = 3600;
  EXPECT_FALSE(quotas.take_samples(key, 3000, kStart));
  const auto refused = quotas.take_samples(key, 700, kStart);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, proto::ProblemCode::quota_exceeded);
  EXPECT_EQ(refused->retry_after, 100U);
  EXPECT_FALSE(quotas.take_samples(key, 700, kStart + seconds(101)));
  quotas.give_samples_back(key, 700);
  EXPECT_FALSE(quotas.take_samples(key, 600, kStart + seconds(101)));
  EXPECT_EQ(quotas.take_samples(key, 3601, kStart)->code, proto::ProblemCode::forbidden) << "waiting wouldn't help";
}

}  // namespace
}  // namespace tessera::server

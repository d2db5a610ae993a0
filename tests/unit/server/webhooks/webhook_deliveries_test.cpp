#include "server/webhooks/webhook_deliveries.h"

#include <condition_variable>
#include <mutex>
#include <stop_token>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "server/metrics/metrics.h"
#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {

using namespace std::chrono_literals;
using proto::WebhookState;

/// In place of the network: answers what it is told to.
class WebhookReceivers {
 public:
  WebhookAnswer send(const WebhookTarget& target, const WebhookRequest& request, const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    sent_.push_back({target.host, request});
    changed_.notify_all();
    if (target.host == "silent.example") {
      changed_.wait(lock, stop, [] { return false; });
      return {0, "no answer in time"};
    }
    return {target.host == "broken.example" ? 500U : 200U};
  }

  using Sent = std::pair<std::string, WebhookRequest>;
  std::vector<Sent> wait_for(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return sent_.size() >= count; });
    return sent_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::vector<Sent> sent_;
};

class WebhookDeliveriesTest : public testing::Test {
 protected:
  std::unique_ptr<WebhookDeliveries> deliveries() {
    const auto secret = folder_.write("secret", "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw");
    std::filesystem::permissions(secret, std::filesystem::perms::owner_read);
    const WebhookRules rules{{"*.example"}, false};
    return std::make_unique<WebhookDeliveries>(table, rules, secret,
                                               [this](const auto& target, const auto& request, const auto& stop) {
                                                 return receivers.send(target, request, stop);
                                               });
  }

  std::string add(const std::string& url) {
    JobOrder order{"", "sha256:" + std::string(64, '0'), 0, {}};
    order.webhook = url;
    return (*table.add(std::move(order))).id;
  }
  std::string canceled(const std::string& url) {
    const std::string id = add(url);
    EXPECT_TRUE(table.cancel(id));
    return id;
  }
  WebhookProgress webhook(const std::string& id) { return (*table.find(id)).webhook; }

  TemporaryFolder folder_;
  JobTable table{{1000, 1000, 1ULL << 40}};
  WebhookReceivers receivers;
};

TEST_F(WebhookDeliveriesTest, TellWhatHasEndedBeforeAndSince) {
  const std::string before = canceled("https://ok.example/a"), waiting = add("https://ok.example/b");
  canceled("");
  const auto sending = deliveries();
  receivers.wait_for(1);
  ASSERT_TRUE(table.fail(waiting, "no luck"));
  const auto sent = receivers.wait_for(2);
  ASSERT_TRUE(sending->shut_down(10s));
  EXPECT_EQ(sent[0].second.headers[0], (std::pair<std::string, std::string>("webhook-id", "msg_" + before)));
  const auto message = nlohmann::json::parse(sent[1].second.body);
  EXPECT_EQ(message["type"], "job.failed");
  EXPECT_EQ(message["data"]["job"]["id"], waiting);
  EXPECT_EQ(message["data"]["job"]["error"], "no luck");
  for (const std::string& id : {before, waiting}) {
    EXPECT_EQ(webhook(id).state, WebhookState::delivered);
    EXPECT_EQ(webhook(id).attempts, 1U);
  }
}

TEST_F(WebhookDeliveriesTest, TryAgainLater) {
  const std::string id = canceled("https://broken.example/");
  const auto sending = deliveries();
  receivers.wait_for(1);
  ASSERT_TRUE(sending->shut_down(10s));
  const WebhookProgress progress = webhook(id);
  EXPECT_EQ(progress.state, WebhookState::pending);
  EXPECT_EQ(progress.error, "it answered 500");
  EXPECT_GT(progress.due, std::chrono::steady_clock::now());
}

TEST_F(WebhookDeliveriesTest, OneThatDoesNotAnswerHoldsUpNoOther) {
  std::vector<std::string> silent;
  for (int i = 0; i < 20; ++i) silent.push_back(canceled("https://silent.example/"));
  const auto sending = deliveries();
  receivers.wait_for(4);
  canceled("https://ok.example/");
  const auto sent = receivers.wait_for(5);
  EXPECT_EQ(sent.back().first, "ok.example");
  ASSERT_TRUE(sending->shut_down(10s)) << "it can be interrupted";
  for (const std::string& id : silent) EXPECT_EQ(webhook(id).attempts, 0U) << "that says nothing of the receiver";
}

TEST_F(WebhookDeliveriesTest, AReceiverIsOneHoweverItIsWritten) {
  const char* const kWritten[] = {"silent.example", "Silent.example", "silent.example:443", "silent.example:0443",
                                  "SILENT.example:00443"};
  for (const char* host : kWritten)
    for (int i = 0; i < 4; ++i) canceled("https://" + std::string(host) + "/");
  const auto sending = deliveries();
  receivers.wait_for(4);
  canceled("https://ok.example/");
  EXPECT_EQ(receivers.wait_for(5).back().first, "ok.example");
  ASSERT_TRUE(sending->shut_down(10s));
}

TEST_F(WebhookDeliveriesTest, WhatIsDeletedIsNotWaitedFor) {
  const std::string id = canceled("https://broken.example/");
  const auto sending = deliveries();
  receivers.wait_for(1);
  while (webhook(id).attempts == 0) std::this_thread::yield();
  EXPECT_EQ(table.remove(id), std::nullopt);
  while (metrics().webhooks_pending != 0) std::this_thread::yield();  // 5 s before it would be due.
  EXPECT_EQ(receivers.wait_for(1).size(), 1U);
}

TEST_F(WebhookDeliveriesTest, GoNowhereThatIsNotAllowedAnyMore) {
  const std::string id = canceled("https://elsewhere.invalid/"), last = canceled("https://ok.example/");
  const auto sending = deliveries();
  EXPECT_EQ(receivers.wait_for(1).front().first, "ok.example");
  while (webhook(id).state == WebhookState::pending) std::this_thread::yield();
  EXPECT_EQ(webhook(id).state, WebhookState::failed);
  EXPECT_NE(webhook(id).error.find("--webhook-host"), std::string::npos);
}

}  // namespace
}  // namespace tessera::server

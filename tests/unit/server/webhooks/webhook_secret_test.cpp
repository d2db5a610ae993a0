#include "server/webhooks/webhook_secret.h"

#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {

constexpr const char* kKnown = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw";
constexpr const char* kMessage = "msg_p5jXN8AQM9LWM0D4loKWxJek";
constexpr std::chrono::sys_seconds kTime{std::chrono::seconds(1614265330)};
constexpr const char* kBody = R"({"test": 2432232314})";

class WebhookSecret : public testing::Test {
 protected:
  std::filesystem::path file(const std::string& text, std::filesystem::perms rights) const {
    const auto path = folder_.write("secret", text);
    std::filesystem::permissions(path, rights);
    return path;
  }
  std::string signature(const std::string& text) const {
    return WebhookSecrets(file(text, std::filesystem::perms::owner_read)).sign(kMessage, kTime, kBody);
  }

 private:
  TemporaryFolder folder_;
};

// The example that libraries for Standard Webhooks have in common.
TEST_F(WebhookSecret, SignsAsTheStandardSays) {
  EXPECT_EQ(signature(kKnown), "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
}

TEST_F(WebhookSecret, EachOfSeveralSigns) {
  const std::string other = "whsec_AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA";
  const std::string mine = signature(kKnown), others = signature(other + '\n');
  EXPECT_NE(mine, others);
  EXPECT_EQ(signature(other + "\n\n  " + kKnown + " \n"), others + ' ' + mine);
}

TEST_F(WebhookSecret, IsOneAndNobodyElses) {
  for (const std::string text : {"", "\n", "MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw", "whsec_",
                                 "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLa", "whsec_!!!!9r8GKYqrTwjUPD8ILPZIo2LaLaSw"})
    EXPECT_THROW(signature(text), std::runtime_error) << text;
  EXPECT_THROW(signature("whsec_" + std::string(88, 'A')), std::runtime_error) << "65 bytes and more";
  EXPECT_THROW(signature(std::string(kKnown) + "\nsomething"), std::runtime_error);
  EXPECT_THROW(WebhookSecrets("/nowhere"), std::runtime_error);
  using std::filesystem::perms;
  EXPECT_NO_THROW(WebhookSecrets(file(kKnown, perms::owner_read | perms::group_read)));
  EXPECT_THROW(WebhookSecrets(file(kKnown, perms::owner_read | perms::others_read)), std::runtime_error);
  try {
    signature(std::string(kKnown) + "!");
    ADD_FAILURE() << "this is no secret";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()).find("MfKQ"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace tessera::server

#include "server/rfc3339.h"

#include <chrono>
#include <cstdint>
#include <string>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

std::string written(std::int64_t since_epoch) {
  return rfc3339(std::chrono::system_clock::time_point(std::chrono::milliseconds(since_epoch)));
}

TEST(Rfc3339, TellsMomentsToTheMillisecond) {
  EXPECT_EQ(written(0), "1970-01-01T00:00:00.000Z");
  EXPECT_EQ(written(951782400007), "2000-02-29T00:00:00.007Z");
  EXPECT_EQ(written(-1), "1969-12-31T23:59:59.999Z");
}

}  // namespace
}  // namespace tessera::server

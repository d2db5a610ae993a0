#include "client/doctor.h"

#include <gtest/gtest.h>

namespace tessera::client {
namespace {

TEST(Doctor, ReadsMetrics) {
  const auto metrics = read_metrics(
      "# HELP a Words 1\n# TYPE a gauge\na 1\nb{x=\"y z\",q=\"2\"} 2.5\nc +Inf\nd not a number\n\nlast 1e9");
  EXPECT_EQ(metrics.at("a"), 1);
  EXPECT_EQ(metrics.at("b{x=\"y z\",q=\"2\"}"), 2.5);
  EXPECT_EQ(metrics.at("last"), 1e9);
  EXPECT_FALSE(metrics.contains("d not a"));
  EXPECT_FALSE(metrics.contains("# HELP a Words"));
  EXPECT_TRUE(read_metrics("").empty());
  EXPECT_TRUE(read_metrics("<html>no metrics</html>").empty());
}

TEST(Doctor, ReadsDates) {
  EXPECT_EQ(read_http_date("Thu, 01 Jan 1970 00:00:10 GMT"), 10);
  EXPECT_EQ(read_http_date("Sun, 06 Nov 1994 08:49:37 GMT"), 784111777);  // RFC 9110, 5.6.7.
  for (const char* other : {"", "Sun, 06 Nov 1994 08:49:37", "yesterday", "Sun, 06 Nov 1994 08:49:37 GMT+1"})
    EXPECT_FALSE(read_http_date(other)) << other;
}

TEST(Doctor, SaysBytesInUnits) {
  EXPECT_EQ(in_units(0), "0 B");
  EXPECT_EQ(in_units(1023), "1023 B");
  EXPECT_EQ(in_units(1536), "1.5 KiB");
  EXPECT_EQ(in_units(4.0 * (1ULL << 30)), "4.0 GiB");
}

}  // namespace
}  // namespace tessera::client

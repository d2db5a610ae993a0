#include "server/log_line.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "proto/wire/printable.h"

namespace tessera::server {
namespace {

using std::chrono::milliseconds;

std::string line(LogFormat format, std::string_view message, std::vector<LogField> fields = {}) {
  spdlog::memory_buf_t out;
  const std::chrono::system_clock::time_point time(milliseconds(1'700'000'000'042));
  write_log_line(format, time, "info", message, fields, out);
  return {out.data(), out.size()};
}

TEST(LogLine, TextQuotesWhatHasToBe) {
  EXPECT_EQ(line(LogFormat::text, "job 1: queued"), "2023-11-14T22:13:20.042Z info job 1: queued\n");
  const std::string told = line(
      LogFormat::text, "access",
      {{"path", "/a"}, {"client", ""}, {"name", "a \"b\" \\ c=d"}, {"bytes", std::uint64_t{12}}, {"seconds", 0.25}});
  EXPECT_EQ(told,
            "2023-11-14T22:13:20.042Z info access path=/a client=\"\" name=\"a \\\"b\\\" \\\\ c=d\" bytes=12 "
            "seconds=0.250000\n");
}

TEST(LogLine, JsonIsAnObject) {
  const auto json = nlohmann::json::parse(line(LogFormat::json, "a \"b\" \\", {{"path", "/\"\\"}, {"status", 404ULL}}));
  EXPECT_EQ(json, nlohmann::json({{"ts", "2023-11-14T22:13:20.042Z"},
                                  {"level", "info"},
                                  {"message", "a \"b\" \\"},
                                  {"path", "/\"\\"},
                                  {"status", 404}}));
}

/// Whatever others send, by every byte that there is, in the middle of words and at their ends.
TEST(LogLine, NothingMakesTwoLinesOfIt) {
  for (int byte = 0; byte < 256; ++byte) {
    const std::string hostile = {'a', static_cast<char>(byte), 'b', static_cast<char>(byte)};
    for (const LogFormat format : {LogFormat::text, LogFormat::json}) {
      const std::string told = line(format, hostile, {{"path", hostile}});
      EXPECT_EQ(told.find_first_of("\n\r"), told.size() - 1) << byte;
      EXPECT_TRUE(proto::is_utf8(told)) << byte;
      EXPECT_TRUE(format == LogFormat::text || nlohmann::json::accept(told)) << byte << ": " << told;
    }
  }
  const std::string separators =
      "a\xE2\x80\xA8"
      "b\xC2\x85"
      "c\x1b[31m";  // Lines to some viewers, and a colour.
  EXPECT_EQ(line(LogFormat::text, separators), "2023-11-14T22:13:20.042Z info a?b?c?[31m\n");
}

}  // namespace
}  // namespace tessera::server

#include "server/http/request_id.h"

#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tessera::server {
namespace {

TEST(RequestId, TakesWhatIsSafe) {
  for (const std::string given : {"a", "3f2504e0-4f89-11d3-9a0c-0305e82c3301", "00-0af7651916cd43dd8448eb211c80319c-01",
                                  "Root=1-67891233-abcdef012345678912345678", "aGVsbG8+/w==", "me@host:1.2~3"})
    EXPECT_EQ(request_id(given), given);
  EXPECT_EQ(request_id(std::string(128, 'x')), std::string(128, 'x'));
}

TEST(RequestId, MakesOneWhereThatIsNot) {
  const std::set<std::string> hostile = {
      "",    std::string(129, 'x'),  "a b",     "a\"b", "a\\b", "a\nb", "a, b", "caf\xc3\xa9", "<a>", "{a}",
      "a;b", std::string("a\0b", 3), "$(date)", "a%0ab"};
  std::set<std::string> made;
  for (const std::string& given : hostile) {
    const std::string id = request_id(given);
    EXPECT_NE(id, given);
    EXPECT_EQ(request_id(id), id);  // It could be given.
    made.insert(id);
  }
  made.insert(request_id(std::nullopt));
  EXPECT_EQ(made.size(), hostile.size() + 1);
}

TEST(RequestId, StandsInHeadersAndProblems) {
  Response problem = problem_response({proto::ProblemCode::not_found, "There is no } here.", {}});
  add_request_id(problem, "id-1");
  EXPECT_EQ(problem.headers.back(), (std::pair<std::string, std::string>("X-Request-Id", "id-1")));
  const auto json = nlohmann::json::parse(problem.body);
  EXPECT_EQ(json["request_id"], "id-1");
  EXPECT_EQ(json["detail"], "There is no } here.");

  Response other = json_response(200, {{"status", "alive"}});
  const std::string body = other.body;
  add_request_id(other, "id-2");
  EXPECT_EQ(other.body, body);
  EXPECT_EQ(other.headers.back().second, "id-2");
}

}  // namespace
}  // namespace tessera::server

#include "server/handlers/json_members.h"

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

std::string listed(std::string_view text) {
  std::string list;
  for (const JsonMember& member : json_members(text)) list += member.name + '=' + std::string(member.value) + '\n';
  return list;
}

TEST(JsonMembers, AreThoseOfTheOutermostObject) {
  EXPECT_EQ(listed(R"( { "a" : {"b": [1, "}"]} , "c":"\"]", "d":[ ] })"),
            "a={\"b\": [1, \"}\"]} \nc=\"\\\"]\"\nd=[ ] \n");
  EXPECT_EQ(listed("{\"\\u0061\":1}"), "a=1\n");
  EXPECT_TRUE(has_member(R"({"x":{"scene":1},"scene":2})", "scene"));
  EXPECT_FALSE(has_member(R"({"x":{"scene":1}})", "scene"));
}

TEST(JsonMembers, AnyTextEnds) {
  const std::string text = R"({"a":{"b":[1,"}\\"]},"c":"\"]","d":[]})";
  for (std::size_t size = 0; size <= text.size(); ++size)
    for (const char c : {'"', '\\', '{', '}', '[', ']', ',', ':'}) listed(text.substr(0, size) + c);
  for (const char* other : {"", "[]", "1", "{", "{}", "{1:2}", "{\"a\"", "{\"a\":", "{\"a\"}", "]}{", "{,}"})
    EXPECT_LE(json_members(other).size(), 1U) << other;
  EXPECT_EQ(json_members("{\"a\":" + std::string(1 << 20, '[')).size(), 1U);
}

TEST(JsonMembers, ElementsAreThoseOfTheOutermostArray) {
  using Elements = std::vector<std::string_view>;
  EXPECT_EQ(json_elements(R"( [1, {"a": [2, "]"]} ,"x,y"] )"), (Elements{"1", R"({"a": [2, "]"]} )", R"("x,y")"}));
  for (const char* text : {"", "[]", "[ ]", "{}", "1"}) EXPECT_EQ(json_elements(text), Elements{}) << text;
  EXPECT_EQ(json_elements("[1, [2"), (Elements{"1", "[2"}));
}

}  // namespace
}  // namespace tessera::server

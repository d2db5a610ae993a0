#include "proto/json_document.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tessera::proto {
namespace {

constexpr std::uint32_t kDepth = 64;

Result<JsonDocument> parse(std::string_view bytes) {
  FieldErrors errors;
  return JsonDocument::parse(bytes, kDepth, errors);
}

/// The document's tree, rebuilt by walking it the way that readers do.
nlohmann::json rebuilt(const JsonDocument& d, JsonDocument::Index i) {
  switch (d.kind(i)) {
    case JsonKind::null:
      return nullptr;
    case JsonKind::boolean:
      return d.boolean(i);
    case JsonKind::whole:
      return d.whole(i);
    case JsonKind::real:
      return d.number(i);
    case JsonKind::string:
      return std::string(d.string(i));
    case JsonKind::array: {
      nlohmann::json array = nlohmann::json::array();
      for (auto c = i + 1; c < d.next(i); c = d.next(c)) array.push_back(rebuilt(d, c));
      EXPECT_EQ(d.size(i), array.size());
      return array;
    }
    case JsonKind::object: {
      nlohmann::json object = nlohmann::json::object();
      for (auto c = i + 1; c < d.next(i); c = d.next(c + 1)) object[std::string(d.string(c))] = rebuilt(d, c + 1);
      EXPECT_EQ(d.size(i), object.size());
      return object;
    }
  }
  return {};
}

TEST(JsonDocument, HoldsWhatTheTextSays) {
  for (const char* text : {"0", "-1", "1.5e3", "18446744073709551615", "1e19", "true", "null", R"("")",
                           R"("\u00e9\ud83d\ude00")", "[]", "{}", R"([[], {}, [1, [2, {"a": [3]}]], "x"])",
                           R"({"a": {"b": [1, 2.5, "c", null, false], "": {}}, "d": -7, "e~/f": "\"\\\n"})"}) {
    const auto document = parse(text);
    ASSERT_TRUE(document) << text;
    EXPECT_EQ(rebuilt(*document, JsonDocument::kRoot), nlohmann::json::parse(text)) << text;
  }
}

TEST(JsonDocument, EveryNodeHasAPointerThatLeadsToIt) {
  const std::string text = R"({"a": [10, {"b/c": [[], 1, {"~": 2}]}, 3], "d": {"": {"e": [4]}}})";
  const auto document = parse(text);
  ASSERT_TRUE(document);
  const auto json = nlohmann::json::parse(text);
  int visited = 0;
  const auto visit = [&](const auto& self, JsonDocument::Index i) -> void {
    const std::string pointer = document->pointer(i);
    EXPECT_EQ(json.at(nlohmann::json::json_pointer(pointer)), rebuilt(*document, i)) << pointer;
    ++visited;
    const bool is_object = document->kind(i) == JsonKind::object;
    if (!is_object && document->kind(i) != JsonKind::array) return;
    for (auto c = i + 1; c < document->next(i);) {
      const auto value = is_object ? c + 1 : c;
      self(self, value);
      c = document->next(value);
    }
  };
  visit(visit, JsonDocument::kRoot);
  EXPECT_EQ(visited, 14);
}

struct Malformed {
  std::string text;
  std::string detail;  // how it starts
};

TEST(JsonDocument, MalformedTextIsRefusedWithItsPlace) {
  using namespace std::string_literals;
  for (const auto& [text, detail] : std::vector<Malformed>{
           {"", "Not JSON at byte 0 (line 1, column 1): "},
           {"{\n \"a\": 1,\n}", "Not JSON at byte 11 (line 3, column 1): "},
           {"[1] x", "Not JSON at byte 4 (line 1, column 5): "},
           {"\xEF\xBB\xBF{}", "Not JSON at byte 0 (line 1, column 1): a byte order mark."},
           {"[\"a\xFF\"]", "Not JSON at byte 3 (line 1, column 4): "},
           {"123\0"s, "Not JSON at byte 3 (line 1, column 4): a NUL byte."},
           {"[0.\xD2]", "Not JSON at byte 3 (line 1, column 4): while parsing value - invalid number"},
           {"[NaN]", "Not JSON at byte 1 (line 1, column 2): "},
           {"[1, 2", "Not JSON at byte 5 (line 1, column 6): "},
       }) {
    const auto document = parse(text);
    ASSERT_FALSE(document) << text;
    EXPECT_EQ(document.problem().code, ProblemCode::malformed_json) << text;
    EXPECT_TRUE(document.problem().detail.starts_with(detail)) << document.problem().detail;
    EXPECT_NO_THROW(to_json(document.problem()).dump()) << "every text is UTF-8";
  }
}

TEST(JsonDocument, DepthIsLimitedWithoutRecursion) {
  const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  EXPECT_TRUE(parse(nested(kDepth)));
  const auto deeper = parse(nested(kDepth + 1));
  ASSERT_FALSE(deeper);
  EXPECT_EQ(deeper.problem().code, ProblemCode::malformed_json);
  ASSERT_EQ(deeper.problem().errors.size(), 1U);
  std::string pointer;
  for (std::uint32_t i = 0; i < kDepth; ++i) pointer += "/0";
  EXPECT_EQ(deeper.problem().errors[0].pointer, pointer);

  std::string objects;
  for (int i = 0; i < 100'000; ++i) objects += "{\"a\":";
  for (const std::string& text : {nested(100'000), std::string(100'000, '['), objects}) {
    const auto document = parse(text);
    ASSERT_FALSE(document);
    EXPECT_EQ(document.problem().code, ProblemCode::malformed_json);
  }
}

TEST(JsonDocument, ANumberThatOverflowsIsNamed) {
  const auto document = parse(R"({"a": [1, {"b": [0, 1e400]}]})");
  ASSERT_FALSE(document);
  EXPECT_EQ(document.problem().code, ProblemCode::invalid_document);
  ASSERT_EQ(document.problem().errors.size(), 1U);
  EXPECT_EQ(document.problem().errors[0].pointer, "/a/1/b/1");
}

TEST(JsonDocument, RepeatedKeysAreErrors) {
  FieldErrors errors;
  const auto document =
      JsonDocument::parse(R"({"x": 1, "list": [0, {"a": 1, "b": 2, "a": 3, "a": 4}], "x": 2})", kDepth, errors);
  ASSERT_TRUE(document);
  const Problem problem = std::move(errors).as_problem("document");
  ASSERT_EQ(problem.errors.size(), 2U);
  EXPECT_EQ(problem.errors[0].pointer, "/list/1/a");
  EXPECT_EQ(problem.errors[1].pointer, "/x");
}

}  // namespace
}  // namespace tessera::proto

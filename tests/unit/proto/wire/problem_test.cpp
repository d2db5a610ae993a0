#include "proto/wire/problem.h"

#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace tessera::proto {
namespace {

TEST(ProblemTable, EveryCodeFindsItsOwnRow) {
  std::set<std::string_view> names;
  for (const ProblemEntry& row : problem_table()) {
    EXPECT_EQ(&entry(row.code), &row) << row.name;
    EXPECT_TRUE(names.insert(row.name).second) << row.name;
    EXPECT_TRUE(400 <= row.status && row.status < 600) << row.name;
    EXPECT_FALSE(row.title.empty()) << row.name;
    EXPECT_TRUE(row.help.ends_with('.')) << row.name;
  }
  EXPECT_EQ(problem_table().size(), static_cast<std::size_t>(ProblemCode::internal_error) + 1);
}

TEST(Problem, IsProblemDetailsOnTheWire) {
  const Problem problem{ProblemCode::invalid_document, "Two things.", {{"/a/0", "Wrong."}}};
  EXPECT_EQ(to_json(problem), nlohmann::json::parse(R"({"type": "/problems/invalid_document",
    "title": "The document is not valid", "status": 422, "detail": "Two things.", "code": "invalid_document",
    "errors": [{"pointer": "/a/0", "detail": "Wrong."}]})"));
  EXPECT_EQ(to_json(Problem{ProblemCode::not_found, "No job has this id.", {}})["errors"], nlohmann::json::array());
}

}  // namespace
}  // namespace tessera::proto

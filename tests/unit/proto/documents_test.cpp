// The documents in tests/data/documents: tests/e2e/schema_test.py holds the JSON Schemas to the same ones.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "proto/parse.h"
#include "tests/unit/proto/test_files.h"

namespace tessera::proto {
namespace {

const std::filesystem::path kDocuments = std::filesystem::path(TESSERA_SOURCE_DIR) / "tests/data/documents";

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The files that the documents name, each as an asset and as a blob.
void add_files(TestFiles& files) {
  for (const auto& entry : std::filesystem::directory_iterator(kDocuments / "files")) {
    files.add_asset(entry.path().filename().string(), content(entry.path()));
    files.add_blob(content(entry.path()));
  }
}

/// The problem that a document meets, by what its file name says it is.
std::optional<Problem> problem_of(const std::filesystem::path& path, const FileSource& files) {
  const std::string bytes = content(path);
  if (path.filename().string().starts_with("job_")) {
    const auto job = parse_job(bytes, files, Limits());
    return job ? std::nullopt : std::optional(job.problem());
  }
  EXPECT_TRUE(path.filename().string().starts_with("scene_")) << path;
  const auto scene = parse_scene(bytes, files, Limits());
  return scene ? std::nullopt : std::optional(scene.problem());
}

TEST(Documents, GoodOnesAreAccepted) {
  TestFiles files;
  add_files(files);
  int seen = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kDocuments / "good")) {
    const auto problem = problem_of(entry.path(), files);
    EXPECT_FALSE(problem) << entry.path().filename() << to_json(*problem).dump(2);
    ++seen;
  }
  EXPECT_GT(seen, 0);
}

TEST(Documents, BadOnesAreRefusedAtEveryPlace) {
  TestFiles files;
  add_files(files);
  const auto table = nlohmann::json::parse(content(kDocuments / "expected.json"));
  std::set<std::string> seen;
  for (const auto& entry : std::filesystem::directory_iterator(kDocuments / "bad")) {
    const std::string name = entry.path().filename();
    SCOPED_TRACE(name);
    seen.insert(name);
    const auto problem = problem_of(entry.path(), files);
    ASSERT_TRUE(problem) << "accepted";
    ASSERT_TRUE(table.contains(name)) << "not in expected.json";
    EXPECT_EQ(problem->code, ProblemCode::invalid_document);
    std::vector<std::string> expected, found;
    for (const auto& error : table[name]) expected.push_back(error["pointer"]);
    for (const FieldError& error : problem->errors) {
      found.push_back(error.pointer);
      EXPECT_GT(error.detail.size(), 10U);
      EXPECT_TRUE(error.detail.ends_with(".")) << error.detail;
    }
    std::ranges::sort(expected);
    std::ranges::sort(found);
    EXPECT_EQ(found, expected) << to_json(*problem).dump(2);
  }
  for (const auto& [name, errors] : table.items()) EXPECT_TRUE(seen.contains(name)) << name << " is missing in bad/";
}

}  // namespace
}  // namespace tessera::proto

#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>

#include "proto/parse.h"
#include "tests/support/shared_data.h"
#include "tests/unit/proto/test_files.h"

namespace tessera::proto {
namespace {

constexpr int kFilesInSuite = 318;

/// Seriot's "Parsing JSON is a minefield": y_ files are JSON, n_ files are not, i_ files may be either.
template <typename Parse>
void run_suite(Parse parse) {
  const auto data = shared_data();
  if (!data || !std::filesystem::exists(*data / "json-test-suite")) {
    GTEST_SKIP() << "SKIPPED: json-test-suite is not there; set TESSERA_SHARED_DATA to the folder that holds it.";
  }
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(*data / "json-test-suite/test_parsing")) {
    const std::string name = entry.path().filename();
    SCOPED_TRACE(name);
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string bytes(std::istreambuf_iterator<char>(file), {});
    const auto result = parse(bytes);
    ++files;
    ASSERT_FALSE(result) << "no file of the suite is a document of ours";
    const ProblemCode code = result.problem().code;
    if (name.starts_with("y_")) {
      EXPECT_EQ(code, ProblemCode::invalid_document);
      EXPECT_FALSE(result.problem().errors.empty());
    } else if (name.starts_with("n_")) {
      EXPECT_EQ(code, ProblemCode::malformed_json);
    } else {
      EXPECT_TRUE(code == ProblemCode::malformed_json || code == ProblemCode::invalid_document);
    }
    EXPECT_FALSE(result.problem().detail.empty());
  }
  EXPECT_EQ(files, kFilesInSuite);
}

TEST(JsonTestSuite, AsScenes) {
  run_suite([](std::string_view bytes) { return parse_scene(bytes, NoFiles(), Limits()); });
}
TEST(JsonTestSuite, AsJobs) {
  run_suite([](std::string_view bytes) { return parse_job(bytes, NoFiles(), Limits()); });
}

}  // namespace
}  // namespace tessera::proto

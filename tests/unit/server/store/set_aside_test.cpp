#include "server/store/set_aside.h"

#include <fstream>
#include <iterator>
#include <system_error>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {
namespace fs = std::filesystem;

std::string text_of_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(SetAside, OverwritesNothingAndCounts) {
  const TemporaryFolder data;
  fs::create_directory(data.path() / "blobs");
  const fs::path into = data.path() / "set-aside";
  const std::uint64_t before = files_set_aside();
  for (int i = 0; i < 3; ++i) {
    const fs::path damaged = data.write("blobs/abc", std::to_string(i));
    const fs::path there = set_aside(damaged, into, "a test");
    EXPECT_EQ(there, into / ("blobs-abc" + (i == 0 ? std::string() : '.' + std::to_string(i))));
    EXPECT_FALSE(fs::exists(damaged));
    EXPECT_EQ(text_of_file(there), std::to_string(i));
  }
  EXPECT_EQ(text_of_file(into / "blobs-abc"), "0");
  EXPECT_EQ(files_set_aside(), before + 3);
}

TEST(SetAside, SaysWhenItCannot) {
  const TemporaryFolder data;
  EXPECT_EQ(set_aside(data.path() / "blobs" / "gone", data.path() / "set-aside", "a test"), fs::path());
  const fs::path damaged = data.write("abc", "damaged");
  EXPECT_THROW(set_aside(damaged, data.path() / "lost" / "set-aside", "a test"), std::system_error);
  EXPECT_EQ(text_of_file(damaged), "damaged");
}

}  // namespace
}  // namespace tessera::server

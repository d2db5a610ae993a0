#include "server/store/disk_health.h"

#include <filesystem>
#include <limits>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {
namespace fs = std::filesystem;

TEST(DiskHealth, SeesFoldersComeAndGo) {
  const TemporaryFolder data;
  for (const char* name : {"blobs", "scenes"}) fs::create_directory(data.path() / name);
  EXPECT_EQ(disk_health(data.path(), 0).problem, "");
  EXPECT_GT(disk_health(data.path(), 0).free_bytes, 0U);
  EXPECT_TRUE(fs::is_empty(data.path() / "blobs")) << "looking leaves nothing";
  fs::remove(data.path() / "scenes");
  EXPECT_EQ(disk_health(data.path(), 0).problem.rfind("scenes/ of the data folder is lost: ", 0), 0U);
  fs::create_directory(data.path() / "scenes");
  EXPECT_EQ(disk_health(data.path(), 0).problem, "");
}

TEST(DiskHealth, AsksForAsMuchAsThereHasToBe) {
  const TemporaryFolder data;
  for (const char* name : {"blobs", "scenes"}) fs::create_directory(data.path() / name);
  const std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
  EXPECT_NE(disk_health(data.path(), most).problem.find("--min-free-disk"), std::string::npos);
}

}  // namespace
}  // namespace tessera::server

#include "server/store/store_watch.h"

#include <cerrno>
#include <filesystem>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {
using proto::ProblemCode;

TEST(StoreWatch, SeesTheDiskComeAndGo) {
  const TemporaryFolder data;
  const auto folder = data.path() / "blobs";
  std::filesystem::create_directory(folder);
  StoreWatch watch(folder);
  EXPECT_TRUE(watch.health().writable);
  EXPECT_EQ(watch.health().problem, "");
  EXPECT_GT(watch.health().free_bytes, 0U);
  EXPECT_TRUE(std::filesystem::is_empty(folder)) << "looking leaves nothing";
  std::filesystem::remove(folder);
  EXPECT_TRUE(watch.health().writable) << "that was before";
  watch.look();
  EXPECT_FALSE(watch.health().writable);
  EXPECT_NE(watch.health().problem.find(folder.string()), std::string::npos);
  EXPECT_EQ(watch.health().free_bytes, 0U);
  std::filesystem::create_directory(folder);
  watch.look();
  EXPECT_TRUE(watch.health().writable);
}

TEST(StoreWatch, TellsWhatTheDiskRefused) {
  const TemporaryFolder data;
  StoreWatch watch(data.path());
  EXPECT_EQ(watch.health().refusals, 0U);
  for (const int error : {ENOSPC, EDQUOT, EFBIG})
    EXPECT_EQ(watch.refuse(StorageError(error, "cannot write it")).code, ProblemCode::insufficient_storage);
  for (const int error : {EROFS, ENOENT, EIO, EACCES, EMFILE, ESTALE})
    EXPECT_EQ(watch.refuse(StorageError(error, "cannot open it")).code, ProblemCode::storage_unavailable);
  EXPECT_EQ(watch.health().refusals, 9U);
  EXPECT_EQ(watch.health().last_refusal.rfind("cannot open it: ", 0), 0U);
}

}  // namespace
}  // namespace tessera::server

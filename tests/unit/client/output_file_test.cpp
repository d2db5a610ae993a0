#include "client/output_file.h"

#include <signal.h>
#include <sys/resource.h>

#include "client/failure.h"
#include "tests/support/temporary_folder.h"

namespace tessera::client {
namespace {

namespace fs = std::filesystem;
using OutputFile = FolderTest;

std::size_t files_in(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

TEST_F(OutputFile, ReplacesWhatStoodThere) {
  const fs::path path = write("out.png", "old and longer");
  write_atomically(path, "new");
  EXPECT_EQ(read(path), "new");
  EXPECT_EQ(files_in(folder_), 1U);
}

TEST_F(OutputFile, WritesThroughASymbolicLink) {
  const fs::path target = write("real.png", "old");
  fs::create_symlink("real.png", folder_ / "link.png");
  write_atomically(folder_ / "link.png", "new");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link.png"));
  EXPECT_EQ(read(target), "new");
}

TEST_F(OutputFile, WritesToADeviceWithoutReplacingIt) {
  write_atomically("/dev/null", "bytes");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(OutputFile, LeavesNothingBehindWhenItFails) {
  fs::create_directories(folder_ / "taken.png" / "by-a-folder");
  EXPECT_THROW(write_atomically(folder_ / "taken.png", "bytes"), Failure);
  EXPECT_THROW(write_atomically(folder_ / "no" / "such" / "out.png", "bytes"), Failure);
  EXPECT_EQ(files_in(folder_), 1U);
}

TEST_F(OutputFile, SaysThatADiskIsFull) {
  try {
    write_atomically("/dev/full", "bytes");
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.kind(), Failure::Kind::local_file);
    EXPECT_NE(std::string(failure.what()).find("/dev/full: No space left"), std::string::npos) << failure.what();
  }
}

TEST_F(OutputFile, LeavesWhatStoodThereWhenItCannotWriteAll) {
  const fs::path path = write("out.png", "old");
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{1000, before.rlim_max};
  const auto old_action = signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(write_atomically(path, std::string(5000, 'x')), Failure);
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, old_action);
  EXPECT_EQ(read(path), "old");
  EXPECT_EQ(files_in(folder_), 1U);
}

TEST_F(OutputFile, KnowsBeforehandWhereItCannotWrite) {
  EXPECT_NO_THROW(expect_writable(folder_ / "out.png"));
  EXPECT_NO_THROW(expect_writable("out.png"));
  EXPECT_NO_THROW(expect_writable("/dev/null"));
  EXPECT_THROW(expect_writable(folder_), Failure);
  EXPECT_THROW(expect_writable(folder_ / "no" / "out.png"), Failure);
}

}  // namespace
}  // namespace tessera::client

#include "server/store/shelf.h"

#include <atomic>
#include <chrono>
#include <fstream>
#include <memory>
#include <span>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "proto/wire/abandoned.h"
#include "server/store/file_hash.h"
#include "server/store/storage_error.h"
#include "tests/support/temporary_folder.h"

namespace tessera::server {
namespace {
namespace fs = std::filesystem;
using State = Shelf::State;

std::atomic<int> looks{0};

bool begins_as_its_name(int file, const std::string& name, const std::stop_token& stop) {
  ++looks;
  proto::throw_if_abandoned(stop);
  char first = 0;
  return ::pread(file, &first, 1, 0) == 1 && first == name.front();
}

std::string name_of(char digit) { return std::string(64, digit); }
bool never(const std::string&) { return false; }

class ShelfTest : public testing::Test {
 protected:
  ShelfTest() {
    fs::create_directory(folder());
    looks = 0;
  }

  fs::path folder() const { return temporary_.path() / "shelf"; }
  fs::path path(char digit) const { return folder() / (name_of(digit) + ".x"); }
  Shelf open() const { return {folder(), ".x", begins_as_its_name, temporary_.path() / "aside"}; }

  /// Written and used so long ago.
  void write(char digit, std::size_t bytes, std::chrono::seconds ago = std::chrono::hours(3)) const {
    std::ofstream(path(digit), std::ios::binary) << std::string(bytes, digit);
    fs::last_write_time(path(digit), fs::file_time_type::clock::now() - ago);
  }
  /// What has just been changed is looked at anew each time.
  void settle(char digit) const {
    struct stat status;
    for (;;) {
      ASSERT_EQ(::stat(path(digit).c_str(), &status), 0);
      timespec now{};
      ::clock_gettime(CLOCK_REALTIME, &now);
      if ((now.tv_sec - status.st_ctim.tv_sec) * 1000 + (now.tv_nsec - status.st_ctim.tv_nsec) / 1'000'000 > 150)
        return;
      std::this_thread::yield();
    }
  }

  std::size_t aside() const {
    std::error_code none;
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(temporary_.path() / "aside", none), {}));
  }

  TemporaryFolder temporary_;
};

TEST_F(ShelfTest, LooksOnceAtWhatDoesntChange) {
  write('a', 10, std::chrono::seconds(60));
  Shelf shelf = open();
  settle('a');
  for (int i = 0; i < 5; ++i) EXPECT_EQ(shelf.find(name_of('a'), {}).state, State::whole);
  EXPECT_EQ(looks, 1);
  EXPECT_EQ(shelf.find(name_of('b'), {}).state, State::missing);

  std::ofstream(path('a'), std::ios::app) << 'x';  // Another size,
  settle('a');
  EXPECT_EQ(shelf.find(name_of('a'), {}).state, State::whole);
  EXPECT_EQ(looks, 2);
  fs::rename(path('a'), path('b'));  // another name,
  EXPECT_EQ(shelf.find(name_of('b'), {}).state, State::damaged);
  EXPECT_EQ(looks, 3);
  EXPECT_EQ(shelf.find(name_of('b'), {}).state, State::damaged) << "it is remembered, and set aside";
  EXPECT_EQ(looks, 3);
  EXPECT_EQ(aside(), 1U);
}

TEST_F(ShelfTest, NoticesDamageBehindAnUnchangedTime) {
  write('a', 10, std::chrono::seconds(60));
  Shelf shelf = open();
  settle('a');
  EXPECT_EQ(shelf.find(name_of('a'), {}).state, State::whole);
  const auto time = fs::last_write_time(path('a'));
  std::ofstream(path('a'), std::ios::binary) << "xaaaaaaaaa";
  fs::last_write_time(path('a'), time);
  EXPECT_EQ(shelf.find(name_of('a'), {}).state, State::damaged);
}

TEST_F(ShelfTest, NoticesDamageAtOnceAfterAUse) {
  Shelf shelf = open();
  for (int round = 0; round < 20; ++round) {  // Within one tick of the file system's clock.
    write('a', 10, std::chrono::seconds(0));
    EXPECT_EQ(shelf.find(name_of('a'), {}).state, State::whole);
    std::ofstream(path('a'), std::ios::binary) << "xaaaaaaaaa";
    EXPECT_EQ(shelf.find(name_of('a'), {}).state, State::damaged);
  }
  EXPECT_EQ(aside(), 20U);
}

TEST_F(ShelfTest, AUseIsNotedInTheFilesTime) {
  write('a', 10, std::chrono::hours(3));
  Shelf shelf = open();
  settle('a');
  EXPECT_EQ(shelf.find(name_of('a'), {}).state, State::whole);
  EXPECT_LT(fs::file_time_type::clock::now() - fs::last_write_time(path('a')), std::chrono::minutes(1));
  EXPECT_EQ(shelf.find(name_of('a'), {}).state, State::whole);
  EXPECT_EQ(looks, 1) << "nobody else touched it";
  const auto recently = fs::file_time_type::clock::now() - std::chrono::minutes(30);
  fs::last_write_time(path('a'), recently);
  shelf.touch(name_of('a'));
  EXPECT_EQ(fs::last_write_time(path('a')), recently) << "not at every use";
}

TEST_F(ShelfTest, KeepsInPlaceOfWhatIsDamaged) {
  Shelf shelf = open();
  const auto received = [&](const std::string& text) {
    auto file = std::make_unique<ReceivedFile>(folder());
    file->write(std::as_bytes(std::span(text)));
    return file;
  };
  EXPECT_FALSE(shelf.keep(name_of('a'), *received("aaa"), {}));
  EXPECT_TRUE(shelf.keep(name_of('a'), *received("abc"), {}));
  std::ofstream(path('a')) << "xyz";
  EXPECT_FALSE(shelf.keep(name_of('a'), *received("abc"), {}));
  EXPECT_EQ(shelf.find(name_of('a'), {}).state, State::whole);
  EXPECT_EQ(aside(), 1U);
  EXPECT_EQ(shelf.remove(name_of('a'), [] { return false; }), Shelf::Removal::removed);
  EXPECT_EQ(shelf.find(name_of('a'), {}).state, State::missing) << "nobody needs to know that it was damaged once";
}

TEST_F(ShelfTest, ADamagedFileThatWasHealedMeanwhileStays) {
  write('a', 10);
  Shelf shelf = open();
  std::ofstream(path('a'), std::ios::binary) << 'x';
  shelf.set_aside_as_damaged(name_of('a'), "a test");
  EXPECT_EQ(aside(), 1U);
  shelf.set_aside_as_damaged(name_of('a'), "a test");
  EXPECT_EQ(aside(), 1U);
}

TEST_F(ShelfTest, StopsLooking) {
  write('a', 10);
  Shelf shelf = open();
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(shelf.find(name_of('a'), stop.get_token()), proto::Abandoned);
  EXPECT_EQ(shelf.find(name_of('a'), {}).state, State::whole);

  const fs::path large = temporary_.path() / "large";
  std::ofstream(large) << std::string(3 << 20, 'x');
  const FileDescriptor file(::open(large.c_str(), O_RDONLY));
  EXPECT_THROW(hash_open_file(file.value(), 0, stop.get_token()), proto::Abandoned);
  EXPECT_EQ(hash_open_file(file.value(), 1, {}), proto::content_hash(std::string((3 << 20) - 1, 'x')));
}

TEST_F(ShelfTest, RemovesNothingThatIsHeldOrNeeded) {
  write('a', 10);
  Shelf shelf = open();
  const auto no = [] { return false; };
  {
    const auto found = shelf.find(name_of('a'), {});
    EXPECT_EQ(shelf.remove(name_of('a'), no), Shelf::Removal::held);
    EXPECT_TRUE(shelf.sweep({.bytes = 1}, never, {}).names.empty());
  }
  EXPECT_EQ(shelf.remove(name_of('a'), [] { return true; }), Shelf::Removal::needed);
  EXPECT_EQ(shelf.remove(name_of('a'), no), Shelf::Removal::removed);
  EXPECT_EQ(shelf.remove(name_of('a'), no), Shelf::Removal::missing);
  EXPECT_FALSE(fs::exists(path('a')));
}

TEST_F(ShelfTest, SweepsByBytesTheLongestUnusedFirst) {
  for (const char digit : {'a', 'b', 'c', 'd'}) write(digit, 100, std::chrono::hours(10 - digit % 8));
  std::ofstream(folder() / "other") << std::string(1000, 'x');
  Shelf shelf = open();
  EXPECT_TRUE(shelf.sweep({.bytes = 400}, never, {}).names.empty());
  EXPECT_EQ(shelf.find(name_of('a'), {}).state, State::whole);  // Used now.
  const auto swept = shelf.sweep({.bytes = 250}, [](const std::string& name) { return name == name_of('c'); }, {});
  EXPECT_EQ(swept.names, (std::vector{name_of('b'), name_of('d')}));
  EXPECT_EQ(swept.bytes, 200U);
  EXPECT_EQ(shelf.find(name_of('b'), {}).state, State::expired);
  EXPECT_EQ(shelf.remove(name_of('b'), [] { return false; }), Shelf::Removal::expired);
  EXPECT_EQ(open().find(name_of('d'), {}).state, State::expired) << "the next start knows it too";
  EXPECT_TRUE(fs::exists(folder() / "other")) << "not ours";
}

TEST_F(ShelfTest, SweepsByAge) {
  write('a', 100, std::chrono::hours(30));
  write('b', 100, std::chrono::hours(20));
  Shelf shelf = open();
  EXPECT_TRUE(shelf.sweep({.age = std::chrono::hours(31)}, never, {}).names.empty());
  EXPECT_EQ(shelf.sweep({.age = std::chrono::hours(24)}, never, {}).names, std::vector{name_of('a')});
  EXPECT_TRUE(shelf.sweep({}, never, {}).names.empty()) << "no limits";
}

TEST_F(ShelfTest, ScrubsWhateverIsKnown) {
  for (const char digit : {'a', 'b', 'c'}) write(digit, 10);
  Shelf shelf = open();
  for (const char digit : {'a', 'b', 'c'}) EXPECT_EQ(shelf.find(name_of(digit), {}).state, State::whole);
  std::ofstream(path('b')) << "x";
  std::vector<fs::path> damaged;
  const auto scrubbed = shelf.scrub([&](const fs::path& file) { damaged.push_back(file); });
  EXPECT_EQ(scrubbed.files, 3U);
  EXPECT_EQ(scrubbed.bytes, 21U);
  EXPECT_EQ(scrubbed.damaged, 1U);
  EXPECT_EQ(damaged, std::vector{path('b')});
  EXPECT_EQ(shelf.find(name_of('b'), {}).state, State::damaged);
}

TEST_F(ShelfTest, ALostFolderIsNoEmptyOne) {
  write('a', 10);
  Shelf shelf = open();
  fs::remove_all(folder());
  EXPECT_THROW(shelf.find(name_of('a'), {}), StorageError);
  EXPECT_THROW(shelf.remove(name_of('a'), [] { return false; }), StorageError);
  EXPECT_THROW(shelf.sweep({.bytes = 1}, never, {}), StorageError);
}

TEST_F(ShelfTest, ManyAtOnceLookOnce) {
  write('a', 10, std::chrono::seconds(60));
  Shelf shelf = open();
  settle('a');
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 8; ++i)
      threads.emplace_back([&] { EXPECT_EQ(shelf.find(name_of('a'), {}).state, State::whole); });
  }
  EXPECT_EQ(looks, 1);
}

TEST_F(ShelfTest, HealingAndDamageMeetWithoutLoss) {
  Shelf shelf = open();
  std::vector<std::jthread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&, i] {
      for (int round = 0; round < 50; ++round) {
        ReceivedFile file(folder());
        file.write(std::as_bytes(std::span("aaaa", 4)));
        if (i == 0) std::ofstream(path('a'), std::ios::in | std::ios::out) << 'x';
        shelf.keep(name_of('a'), file, {});
      }
    });
  threads.clear();
  ReceivedFile file(folder());
  file.write(std::as_bytes(std::span("aaaa", 4)));
  shelf.keep(name_of('a'), file, {});
  EXPECT_EQ(shelf.find(name_of('a'), {}).state, State::whole);
}

}  // namespace
}  // namespace tessera::server

#include "server/http/lane.h"

#include <latch>
#include <vector>

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

struct Noted final : Lane::Work {
  Noted(std::vector<int>& list, int number, std::latch& latch) : notes(list), name(number), done(latch) {}
  void run() noexcept override {
    notes.push_back(name);
    done.count_down();
  }
  std::vector<int>& notes;
  int name;
  std::latch& done;
};

TEST(Lane, OneThreadKeepsTheOrder) {
  std::latch done(3);
  std::vector<int> notes;
  Noted first(notes, 1, done), second(notes, 2, done), third(notes, 3, done);
  Lane lane(1);
  for (Noted* work : {&first, &second, &third}) lane.push(*work);
  done.wait();
  EXPECT_EQ(notes, (std::vector{1, 2, 3}));
}

TEST(FileBudget, IsForWhatItLivesFor) {
  FileBudget::spend(1ULL << 60);
  {
    const FileBudget budget(10);
    FileBudget::spend(6);
    EXPECT_THROW(FileBudget::spend(5), TooHeavy);
    FileBudget::spend(4);
    EXPECT_THROW(FileBudget::spend(1), TooHeavy);
  }
  FileBudget::spend(1ULL << 60);
}

}  // namespace
}  // namespace tessera::server

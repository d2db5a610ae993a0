#include "core/accel/wide/work_crew.h"

#include <atomic>
#include <new>

#include <gtest/gtest.h>

namespace tessera {
namespace {

TEST(WorkCrew, DoesEveryIndexOnce) {
  for (const unsigned threads : {1U, 2U, 8U}) {
    std::vector<std::atomic<int>> done(1000);
    for_each_index(done.size(), threads, [&](std::size_t i) { ++done[i]; });
    for (const auto& times : done) EXPECT_EQ(times, 1);
  }
}

TEST(WorkCrew, ThrowsWhatWorkThrows) {
  for (const unsigned threads : {1U, 2U, 8U})
    EXPECT_THROW(for_each_index(100, threads,
                                [](std::size_t i) {
                                  if (i % 10 == 7) throw std::bad_alloc();
                                }),
                 std::bad_alloc);
}

TEST(WorkCrew, DoesTasksThatLeadToOthers) {
  for (const unsigned threads : {1U, 2U, 8U}) {
    TaskStack<int> tasks;
    std::atomic<int> done = 0;
    tasks.push(10);
    tasks.run(threads, [&](int depth) {
      ++done;
      if (depth > 0) tasks.push(depth - 1), tasks.push(depth - 1);
    });
    EXPECT_EQ(done, 2047);
  }
}

TEST(WorkCrew, ATaskThatThrowsEndsAll) {
  for (const unsigned threads : {1U, 2U, 8U}) {
    TaskStack<int> tasks;
    tasks.push(10);
    EXPECT_THROW(tasks.run(threads,
                           [&](int depth) {
                             if (depth == 3) throw std::bad_alloc();
                             tasks.push(depth - 1);
                             tasks.push(depth - 1);
                           }),
                 std::bad_alloc);
  }
}

}  // namespace
}  // namespace tessera

#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

namespace tessera {

/// Which of a scene's objects any ray was tested against. Marked from any number of threads at once; reading while
/// others mark gives a figure of some moment in between.
class ObjectMarks {
 public:
  explicit ObjectMarks(std::size_t objects) : size_(objects), marks_(std::make_unique<std::atomic<bool>[]>(objects)) {}

  /// Writes only the first time, so that threads don't fight for the cache line.
  void mark(std::uint32_t object) {
    if (!marks_[object].load(std::memory_order_relaxed)) marks_[object].store(true, std::memory_order_relaxed);
  }

  bool is_marked(std::uint32_t object) const { return marks_[object].load(std::memory_order_relaxed); }

  std::uint64_t unmarked() const {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < size_; ++i) count += !marks_[i].load(std::memory_order_relaxed);
    return count;
  }

 private:
  std::size_t size_;
  std::unique_ptr<std::atomic<bool>[]> marks_;
};

}  // namespace tessera

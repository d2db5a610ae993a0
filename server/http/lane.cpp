#include "server/http/lane.h"

#include <limits>
#include <utility>

namespace tessera::server {
namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();
thread_local std::uint64_t bytes_left = kUnlimited;

}  // namespace

Lane::Lane(unsigned threads) {
  threads_.reserve(threads);
  try {
    while (threads_.size() < threads) threads_.emplace_back([this] { work_on(); });
  } catch (...) {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
    }
    changed_.notify_all();
    throw;
  }
}

Lane::~Lane() { close(); }

void Lane::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  changed_.notify_all();
  threads_.clear();
}

void Lane::push(Work& work) noexcept {
  {
    const std::lock_guard lock(mutex_);
    work.next = nullptr;
    (first_ ? last_->next : first_) = &work;
    last_ = &work;
  }
  changed_.notify_one();
}

void Lane::work_on() noexcept {
  for (std::unique_lock lock(mutex_);;) {
    changed_.wait(lock, [this] { return first_ || closed_; });
    if (closed_) return;
    Work& work = *std::exchange(first_, first_->next);
    lock.unlock();
    work.run();
    lock.lock();
  }
}

FileBudget::FileBudget(std::uint64_t bytes) { bytes_left = bytes; }
FileBudget::~FileBudget() { bytes_left = kUnlimited; }

bool FileBudget::is_limited() { return bytes_left != kUnlimited; }

void FileBudget::spend(std::uint64_t bytes) {
  if (!is_limited()) return;
  if (bytes > bytes_left) throw TooHeavy{};
  bytes_left -= bytes;
}

}  // namespace tessera::server

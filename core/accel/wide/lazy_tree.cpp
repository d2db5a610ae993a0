#include "core/accel/wide/lazy_tree.h"

#include <chrono>

namespace tessera {

const LazyTree::Ready* LazyTree::make_ready(const std::function<MadeTree()>& make) const {
  const std::lock_guard lock(making_);
  if (const Ready* ready = this->ready()) return ready;
  const auto start = std::chrono::steady_clock::now();
  made_.made = make();
  made_.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  ready_.store(&made_, std::memory_order_release);
  return &made_;
}

}  // namespace tessera

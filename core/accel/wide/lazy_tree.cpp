#include "core/accel/wide/lazy_tree.h"

#include <chrono>
#include <utility>

#include "core/accel/build_stop.h"

namespace tessera {

const LazyTree::Ready* LazyTree::make_ready(const std::function<MadeTree()>& make) const {
  const std::lock_guard lock(making_);
  if (const Ready* ready = this->ready()) return ready;
  BuildStop::check();
  const auto start = std::chrono::steady_clock::now();
  auto made = std::make_unique<Ready>(Ready{make(), 0});
  made->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  made_ = std::move(made);
  ready_.store(made_.get(), std::memory_order_release);
  return made_.get();
}

}  // namespace tessera

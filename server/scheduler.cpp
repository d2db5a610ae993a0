#include "server/scheduler.h"

#include <algorithm>
#include <new>
#include <utility>

#include <boost/asio/post.hpp>

namespace tessera::server {

Scheduler::Scheduler(unsigned threads) : threads_(threads), pool_(threads) {}

Scheduler::~Scheduler() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  pool_.join();
}

void Scheduler::submit(std::size_t count, Unit unit, std::stop_token stop) {
  if (count == 0) return;
  auto batch = std::make_shared<Batch>(Batch{0, count, std::move(unit), std::move(stop)});
  unsigned new_workers = 0;
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    turns_.push_back(batch);
    new_workers = static_cast<unsigned>(std::min<std::size_t>(count, threads_ - workers_));
    workers_ += new_workers;
  }
  try {
    for (; new_workers > 0; --new_workers) boost::asio::post(pool_, [this] { work(); });
  } catch (const std::bad_alloc&) {
    const std::lock_guard lock(mutex_);
    workers_ -= new_workers;
    if (workers_ > 0) return;  // They do it.
    turns_.remove(batch);
    idle_.notify_all();
    throw;
  }
}

void Scheduler::work() {
  for (;;) {
    Turns dropped;
    const Taken taken = take(dropped);
    if (!taken.batch) return;
    taken.batch->unit(taken.index);
  }
}

Scheduler::Taken Scheduler::take(Turns& dropped) {
  const std::lock_guard lock(mutex_);
  if (closed_) turns_.swap(dropped);
  while (!turns_.empty()) {
    std::shared_ptr<Batch> batch = turns_.front();
    if (batch->stop.stop_requested()) {
      dropped.splice(dropped.end(), turns_, turns_.begin());
      continue;
    }
    const std::size_t index = batch->next++;
    Turns& next = batch->next < batch->count ? turns_ : dropped;
    next.splice(next.end(), turns_, turns_.begin());
    return {std::move(batch), index};
  }
  if (--workers_ == 0) idle_.notify_all();
  return {nullptr, 0};
}

bool Scheduler::shut_down(std::chrono::steady_clock::duration patience) {
  std::unique_lock lock(mutex_);
  closed_ = true;
  return idle_.wait_for(lock, patience, [this] { return workers_ == 0; });
}

}  // namespace tessera::server

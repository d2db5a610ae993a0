#include "server/scheduler.h"

#include <algorithm>
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
    turns_.push_back(std::move(batch));
    new_workers = static_cast<unsigned>(std::min<std::size_t>(count, threads_ - workers_));
    workers_ += new_workers;
  }
  for (unsigned i = 0; i < new_workers; ++i) boost::asio::post(pool_, [this] { work(); });
}

void Scheduler::work() {
  for (;;) {
    std::deque<std::shared_ptr<Batch>> dropped;
    const Taken taken = take(dropped);
    if (!taken.batch) return;
    taken.batch->unit(taken.index);
  }
}

Scheduler::Taken Scheduler::take(std::deque<std::shared_ptr<Batch>>& dropped) {
  const std::lock_guard lock(mutex_);
  if (closed_) turns_.swap(dropped);
  while (!turns_.empty()) {
    std::shared_ptr<Batch> batch = std::move(turns_.front());
    turns_.pop_front();
    if (batch->stop.stop_requested()) {
      dropped.push_back(std::move(batch));
      continue;
    }
    const std::size_t index = batch->next++;
    if (batch->next < batch->count) turns_.push_back(batch);
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

#include "server/work/scheduler.h"

#include <new>
#include <system_error>
#include <utility>

namespace tessera::server {

Scheduler::Scheduler(unsigned threads, Clock::duration long_step) : usual_(threads), long_step_(long_step) {
  const std::size_t most = 2 * std::size_t{usual_};
  at_work_.reserve(most);
  threads_.reserve(most);
  try {
    while (threads_.size() < usual_) threads_.emplace_back([this] { work(); });
    watch_ = std::jthread([this] { watch(); });
  } catch (...) {
    close();  // so that those that there are can be waited for
    throw;
  }
}

Scheduler::~Scheduler() {
  close();
  watch_ = {};
}

void Scheduler::submit(std::size_t count, Unit unit, std::stop_token stop) {
  if (count == 0) return;
  auto batch = std::make_shared<Batch>(Batch{0, count, std::move(unit), std::move(stop)});
  batch->paused.reserve(std::min(count, at_work_.capacity()));
  Batches turn{std::move(batch)};
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    turns_.splice(turns_.end(), turn);
  }
  may_work_.notify_all();
  may_wait_.notify_one();
}

void Scheduler::work() {
  Step step;
  while (take(step)) end(step, step.batch->unit(step.index));
}

bool Scheduler::take(Step& step) {
  std::unique_lock lock(mutex_);
  while (!closed_) {
    Batches dropped;
    const auto turn = next_turn(dropped);
    if (!dropped.empty()) {
      lock.unlock();
      dropped.clear();
      lock.lock();
    } else if (turn == turns_.end()) {
      may_work_.wait(lock);
    } else if (at_work_.size() >= most_at_work()) {
      may_wait_.notify_one();
      may_work_.wait(lock);
    } else {
      turns_.splice(turns_.end(), turns_, turn);
      Batch& batch = **turn;
      std::size_t index;
      if (batch.paused.empty()) {
        index = batch.next++;
      } else {
        index = batch.paused.front();
        batch.paused.erase(batch.paused.begin());
      }
      ++batch.at_work;
      step = {*turn, index, Clock::now()};
      account(step.since);
      at_work_.push_back(&step);
      return true;
    }
  }
  return false;
}

void Scheduler::end(Step& step, bool is_done) {
  const std::shared_ptr<Batch> batch = std::move(step.batch);  // destroyed after the lock, if at all
  const std::lock_guard lock(mutex_);
  account(Clock::now());
  std::erase(at_work_, &step);
  if (step.is_long) --long_steps_;
  --batch->at_work;
  if (!is_done) batch->paused.push_back(step.index);
  if (!batch->waits() && batch->at_work == 0) turns_.remove(batch);
  if (at_work_.empty()) idle_.notify_all();
}

Scheduler::Batches::iterator Scheduler::next_turn(Batches& dropped) {
  auto turn = turns_.begin();
  while (turn != turns_.end()) {
    const auto here = turn++;
    if ((*here)->stop.stop_requested())
      dropped.splice(dropped.end(), turns_, here);
    else if ((*here)->waits())
      return here;
  }
  return turn;
}

void Scheduler::watch() {
  std::unique_lock lock(mutex_);
  while (!closed_) {
    if (!is_anyone_waiting()) {
      may_wait_.wait(lock);
      continue;
    }
    Step* first = nullptr;
    for (Step* step : at_work_)
      if (!step->is_long && (!first || step->since < first->since)) first = step;
    const Clock::time_point now = Clock::now(), due = (first ? first->since : now) + long_step_;
    if (now < due) {
      may_wait_.wait_until(lock, due);
      continue;
    }
    first->is_long = true;
    ++long_steps_;
    add_thread_if_needed();
    may_work_.notify_one();
  }
}

void Scheduler::account(Clock::time_point now) {
  const Clock::duration passed = now - std::exchange(accounted_, now);
  const auto busy = static_cast<Clock::rep>(at_work_.size());
  const auto others = std::max<Clock::rep>(usual_ - busy, 0);
  busy_time_ += passed * busy;
  (busy == 0 ? idle_time_ : starved_time_) += passed * others;
}

Scheduler::Usage Scheduler::usage() {
  const auto seconds = [](Clock::duration time) { return std::chrono::duration<double>(time).count(); };
  const std::lock_guard lock(mutex_);
  account(Clock::now());
  return {usual_, at_work_.size(), seconds(busy_time_), seconds(starved_time_), seconds(idle_time_)};
}

bool Scheduler::is_anyone_waiting() const {
  return std::ranges::any_of(turns_, [](const auto& batch) { return batch->waits() && !batch->stop.stop_requested(); });
}

void Scheduler::add_thread_if_needed() {
  if (threads_.size() >= most_at_work()) return;
  try {
    threads_.emplace_back([this] { work(); });
  } catch (const std::system_error&) {  // then with those that there are
  } catch (const std::bad_alloc&) {
  }
}

void Scheduler::close() {
  Batches dropped;  // Destroyed after the lock.
  const std::lock_guard lock(mutex_);
  closed_ = true;
  turns_.swap(dropped);
  may_work_.notify_all();
  may_wait_.notify_all();
}

bool Scheduler::shut_down(Clock::duration patience) {
  close();
  std::unique_lock lock(mutex_);
  return idle_.wait_for(lock, patience, [this] { return at_work_.empty(); });
}

}  // namespace tessera::server

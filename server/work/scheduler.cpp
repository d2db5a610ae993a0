#include "server/work/scheduler.h"

#include <new>
#include <system_error>
#include <utility>

#include "server/work/give_way.h"

namespace tessera::server {
namespace {

/// What is stopped is dropped when it is its turn, or after so long.
constexpr std::chrono::milliseconds kBetweenLooks{100};

double core_seconds(std::chrono::steady_clock::duration time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

Scheduler::Scheduler(unsigned threads, Clock::duration long_step, Clock::duration turn)
    : usual_(threads), long_step_(long_step), turn_(turn), nobody_(open({})) {
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

Scheduler::Job Scheduler::open(const Claim& claim) {
  const std::lock_guard lock(mutex_);
  account_time(Clock::now());
  return std::make_shared<Account>(order_, claim, starved_time_);
}

void Scheduler::submit(std::size_t count, Unit unit, std::stop_token stop) {
  submit(nobody_, count, std::move(unit), std::move(stop));
}

void Scheduler::submit(const Job& job, std::size_t count, Unit unit, std::stop_token stop) {
  if (count == 0) return;
  auto batch = std::make_shared<Batch>(job, count, std::move(unit), std::move(stop));
  batch->paused.reserve(std::min(count, at_work_.capacity()));
  batch->dropper.emplace(batch->stop, Dropper{*this});
  Batches last{std::move(batch)};
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return;
    job->batches.splice(job->batches.end(), last);
    update(*job);
    if (job->batches.back()->stop.stop_requested()) some_stopped_ = true;
    const std::size_t free = most_at_work() - std::min(at_work_.size(), most_at_work());
    if (count > free) make_way_for(*job, count - free);
  }
  may_work_.notify_all();
  may_wait_.notify_one();
}

void Scheduler::make_way_for(const Account& account, std::size_t units) {
  for (Step* step : at_work_) {
    if (units == 0) return;
    if (step->turn.is_called_off_ || !order_.goes_before(account, *step->batch->job)) continue;
    step->turn.is_called_off_ = true;
    --units;
  }
}

void Scheduler::work() {
  give_way();
  for (;;) {
    Step step;
    if (!take(step)) return;
    end(step, step.batch->unit(step.index, step.turn));
  }
}

bool Scheduler::take(Step& step) {
  std::unique_lock lock(mutex_);
  while (!closed_) {
    Batches dropped;
    drop_stopped(dropped);
    auto* next = static_cast<Account*>(order_.next());
    if (next) drop_stopped(*next, dropped);
    if (!dropped.empty()) {
      lock.unlock();
      dropped.clear();
      lock.lock();
      continue;
    }
    if (next && at_work_.size() < most_at_work()) {
      begin(step, *next);
      return true;
    }
    if (next) may_wait_.notify_one();
    tell_idle_threads();
    may_work_.wait(lock);
  }
  return false;
}

void Scheduler::begin(Step& step, Account& account) {
  step.batch = *std::ranges::find_if(account.batches, [](const auto& batch) { return batch->waits(); });
  Batch& batch = *step.batch;
  if (batch.paused.empty()) {
    step.index = batch.next++;
  } else {
    step.index = batch.paused.front();
    batch.paused.erase(batch.paused.begin());
  }
  ++batch.at_work;
  step.since = Clock::now();
  step.turn.until_ = step.since + turn_;
  step.turn.has_idle_threads_ = &has_idle_threads_;
  account_time(step.since);
  at_work_.push_back(&step);
  order_.begin_turn(account);
  update(account);
  tell_idle_threads();
}

void Scheduler::end(Step& step, bool is_done) {
  const std::shared_ptr<Batch>& batch = step.batch;  // destroyed after the lock, if at all; so is what is done
  Batches done;
  const std::lock_guard lock(mutex_);
  const Clock::time_point now = Clock::now();
  account_time(now);
  std::erase(at_work_, &step);
  if (step.is_long) --long_steps_;
  --batch->at_work;
  if (!is_done) batch->paused.push_back(step.index);
  Account& account = *batch->job;
  if (closed_ || (!batch->waits() && batch->at_work == 0)) {
    const auto here = std::ranges::find(account.batches, batch);  // unless it has been dropped
    if (here != account.batches.end()) done.splice(done.end(), account.batches, here);
  }
  order_.end_turn(account, now - step.since);
  update(account);
  if (at_work_.empty()) idle_.notify_all();
}

void Scheduler::Dropper::operator()() const noexcept {
  scheduler.some_stopped_ = true;
  scheduler.may_work_.notify_one();
}

void Scheduler::drop_stopped(Batches& dropped) {
  if (!some_stopped_) return;
  const Clock::time_point now = Clock::now();
  if (now < next_look_) return;  // Jobs that are done request their stops, too, and many may wait.
  some_stopped_ = false;
  next_look_ = now + kBetweenLooks;
  order_.for_all_waiting([&](TurnOrder::Account& account) { drop_stopped(static_cast<Account&>(account), dropped); });
}

void Scheduler::drop_stopped(Account& account, Batches& dropped) {
  for (auto next = account.batches.begin(); next != account.batches.end();) {
    const auto batch = next++;
    if ((*batch)->stop.stop_requested() && (*batch)->waits()) dropped.splice(dropped.end(), account.batches, batch);
  }
  update(account);
}

void Scheduler::update(Account& account) {
  order_.set_waiting(account, std::ranges::any_of(account.batches, [](const auto& batch) { return batch->waits(); }));
}

void Scheduler::tell_idle_threads() { has_idle_threads_ = order_.is_empty() && at_work_.size() < usual_; }

void Scheduler::watch() {
  std::unique_lock lock(mutex_);
  while (!closed_) {
    if (order_.is_empty()) {
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

void Scheduler::account_time(Clock::time_point now) {
  const Clock::duration passed = now - std::exchange(accounted_, now);
  const auto busy = static_cast<Clock::rep>(at_work_.size());
  const auto others = std::max<Clock::rep>(usual_ - busy, 0);
  busy_time_ += passed * busy;
  (busy == 0 ? idle_time_ : starved_time_) += passed * others;
}

Scheduler::Spent Scheduler::spent(const Job& job) {
  const std::lock_guard lock(mutex_);
  const Clock::time_point now = Clock::now();
  account_time(now);
  Clock::duration busy = job->used();
  for (const Step* step : at_work_)
    if (step->batch->job == job) busy += now - step->since;
  return {core_seconds(busy), core_seconds(starved_time_ - job->starved_before)};
}

Scheduler::Usage Scheduler::usage() {
  const std::lock_guard lock(mutex_);
  account_time(Clock::now());
  return {usual_, at_work_.size(), core_seconds(busy_time_), core_seconds(starved_time_), core_seconds(idle_time_)};
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
  order_.for_all_waiting([&](TurnOrder::Account& waiting) {
    auto& account = static_cast<Account&>(waiting);
    dropped.splice(dropped.end(), account.batches);
    update(account);
  });
  may_work_.notify_all();
  may_wait_.notify_all();
}

bool Scheduler::shut_down(Clock::duration patience) {
  close();
  std::unique_lock lock(mutex_);
  return idle_.wait_for(lock, patience, [this] { return at_work_.empty(); });
}

}  // namespace tessera::server

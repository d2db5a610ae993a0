#include <algorithm>
#include <cstddef>
#include <new>
#include <stdexcept>
#include <utility>

#include <spdlog/spdlog.h>

#include "server/jobs/job_table.h"
#include "server/metrics/metrics.h"

// What happens to jobs: how an event changes the table, how it is written down and told, and what goes in time.

namespace tessera::server {
using proto::JobState;
using proto::Problem;
using proto::ProblemCode;

namespace {

/// Of which it is kept in mind that they were there.
constexpr std::size_t kMostExpired = 10'000;

std::size_t index_of(JobState state) { return static_cast<std::size_t>(state); }

/// Whether the state machine has this edge.
bool may_follow(JobState from, JobState to) {
  if (proto::has_ended(from)) return false;
  switch (to) {
    case JobState::queued:
      return false;
    case JobState::preparing:
      return from == JobState::queued;
    case JobState::rendering:
      return from == JobState::preparing;
    case JobState::completed:
      return from == JobState::rendering;
    case JobState::failed:
    case JobState::canceled:
      return true;
  }
  return false;
}

void check_step(JobState from, JobState to) {
  if (!may_follow(from, to))
    throw std::logic_error(std::string(proto::name(from)) + " can't become " + std::string(proto::name(to)));
}

}  // namespace

void JobTable::set_state(Job& job, JobState state) {
  --by_state_[index_of(job.view.state)];
  ++by_state_[index_of(state)];
  job.view.state = state;
}

void JobTable::apply_now(const std::string& id, const JobEvent& event, Aftermath& after) {
  apply(id, event, after);
  spdlog::info("job {}: {}", id, kind_of(event));
  if (std::holds_alternative<JobEvent::Preparing>(event.what)) metrics().queue_wait.add(event.age);
  if (const auto* ended = std::get_if<JobEvent::Ended>(&event.what)) metrics().job_ended(ended->state, event.age);
}

void JobTable::apply(const std::string& id, const JobEvent& event, Aftermath& after) {
  if (const auto* queued = std::get_if<JobEvent::Queued>(&event.what)) return begin(id, event, *queued);
  const auto found = jobs_.find(id);
  if (found == jobs_.end()) return;
  Job& job = found->second;
  JobView& view = job.view;
  if (std::holds_alternative<JobEvent::Removed>(event.what) && proto::has_ended(view.state)) return drop(found, after);
  if (std::holds_alternative<JobEvent::QueuedAgain>(event.what)) return begin_again(job, after);
  if (std::holds_alternative<JobEvent::ImageGone>(event.what)) return give_up_image(job, after);
  if (const auto* tried = std::get_if<JobEvent::WebhookTried>(&event.what)) {
    view.webhook = {tried->state, view.webhook.attempts + 1, tried->error,
                    view.times.queued + event.age + tried->delay};
    return;
  }
  if (proto::has_ended(view.state)) return;
  const auto reach = [&](JobState state) {
    check_step(view.state, state);
    set_state(job, state);
    return view.times.queued + event.age;
  };
  if (std::holds_alternative<JobEvent::Preparing>(event.what)) {
    view.times.preparing = reach(JobState::preparing);
  } else if (const auto* planned = std::get_if<JobEvent::Planned>(&event.what)) {
    view.plan = planned->plan;
  } else if (const auto* rendering = std::get_if<JobEvent::Rendering>(&event.what)) {
    view.times.rendering = reach(JobState::rendering);
    view.structure = rendering->structure;
    view.image = proto::ImageState::partial;
  } else if (const auto* ended = std::get_if<JobEvent::Ended>(&event.what)) {
    view.times.ended = reach(ended->state);
    end(job, *ended, after);
  }
}

void JobTable::begin(const std::string& id, const JobEvent& event, const JobEvent::Queued& queued) {
  if (jobs_.contains(id)) throw std::logic_error("a job was queued twice: " + id);
  Job job;
  job.progress = std::make_shared<Progress>();
  job.film_bytes = image_bytes(queued.order->settings);
  job.view.id = id;
  job.view.order = queued.order;
  job.view.progress = job.progress;
  job.spare_nodes = {id, id};
  job.view.times.created = event.time;
  // It may lie in the future, where the clock has been set back.
  const auto ago = std::max(std::chrono::system_clock::now() - event.time, std::chrono::system_clock::duration::zero());
  job.view.times.queued = JobTimes::Clock::now() - std::chrono::duration_cast<JobTimes::Clock::duration>(ago);
  const std::uint64_t bytes = job.film_bytes;
  if (const auto& retry = queued.order->retry) retries_.insert_or_assign(retry->key, id);
  events_.add(id, queued.order->owner);
  jobs_.emplace(id, std::move(job));
  unfinished_bytes_ += bytes;
  ++unfinished_;
  ++by_state_[index_of(JobState::queued)];
}

void JobTable::begin_again(Job& job, Aftermath& after) {
  JobView& view = job.view;
  if (proto::has_ended(view.state)) {
    if (job.film) drop_film(job, after);
    job.spare_nodes.splice(job.spare_nodes.end(), ended_, job.among_ended);
    job.stop = std::stop_source();
    job.ending = {};
    job.has_image = false;
    unfinished_bytes_ += job.film_bytes;
    ++unfinished_;
  }
  set_state(job, JobState::queued);
  JobView again;
  again.id = view.id;
  again.order = view.order;
  again.times.created = view.times.created;
  again.times.queued = view.times.queued;
  again.progress = job.progress = std::make_shared<Progress>();
  again.webhook = view.webhook;
  view = std::move(again);
}

void JobTable::give_up_image(Job& job, Aftermath& after) {
  if (!proto::has_ended(job.view.state) || job.view.image == proto::ImageState::none) return;
  if (job.film) drop_film(job, after);
  if (job.has_image) forget_files(job, after);
  job.has_image = false;
  job.view.image = proto::ImageState::gone;
}

void JobTable::forget_files(const Job& job, Aftermath& after) {
  if (!job.is_written || !forget_) return;
  after.forget = &forget_;
  after.forgotten.push_back(job.view.id);
}

void JobTable::end(Job& job, const JobEvent::Ended& ended, Aftermath& after) {
  JobView& view = job.view;
  set_state(job, ended.state);
  view.error = ended.error;
  if (ended.structure) view.structure = ended.structure;
  view.never_tested = ended.never_tested;
  job.has_image = ended.has_image;
  if (ended.state == JobState::completed) view.image = proto::ImageState::complete;
  if (!job.film && !job.has_image && view.image != proto::ImageState::none) view.image = proto::ImageState::gone;
  --unfinished_;
  job.stop.request_stop();
  job.needs.reset();  // At once: who is told of the end may delete it.
  unfinished_bytes_ -= job.film_bytes;
  if (job.film) ended_bytes_ += job.film_bytes;
  tell(job.waiters, after);
  job.among_ended = job.spare_nodes.begin();
  ended_.splice(ended_.end(), job.spare_nodes, job.among_ended);
  if (job.film) {
    job.among_images = job.spare_nodes.begin();
    ended_images_.splice(ended_images_.end(), job.spare_nodes, job.among_images);
  }
}

void JobTable::tell(Waiter*& waiters, Aftermath& after) {
  while (waiters) {
    Waiter& waiter = *std::exchange(waiters, waiters->next);
    waiter.next = std::exchange(after.told, &waiter);
  }
}

JobEvent JobTable::now(const Job& job, decltype(JobEvent::what) what) {
  return {std::chrono::system_clock::now(), JobTimes::Clock::now() - job.view.times.queued, std::move(what)};
}

void JobTable::announce(const std::string& id, const JobEvent& event, std::optional<std::uint64_t> seq,
                        Aftermath& after) {
  if (const auto step = step_of(event)) after.audience.add(events_.happened(id, *step, seq));
  if (const auto* removed = std::get_if<JobEvent::Removed>(&event.what))
    after.audience.add(events_.removed(id, removed->owner, removed->expired, seq));
}

void JobTable::write(const std::string& id, const JobEvent& event, Journal::OnFailure on_failure, bool is_awaited,
                     const std::function<void(const Outcome&)>& then) {
  Journal::Append entry{
      id, std::string(kind_of(event)), event.time, [event] { return body_of(event); }, on_failure, is_awaited};
  entry.removes_others = std::holds_alternative<JobEvent::Removed>(event.what);
  entry.removes_image = std::holds_alternative<JobEvent::ImageGone>(event.what);
  if (const auto* ended = std::get_if<JobEvent::Ended>(&event.what)) entry.image = ended->image;
  entry.done = [this, id, event, then](const Outcome& outcome, std::uint64_t seq) {
    if (then) then(outcome);
    Aftermath after;
    if (!outcome) announce(id, event, seq, after);
  };
  journal_->append(std::move(entry));
}

JobTable::Told JobTable::write_and_tell(const std::string& id, const JobEvent& event, Journal::OnFailure on_failure,
                                        const std::function<void(const Outcome&)>& then) {
  const auto promise = std::make_shared<std::promise<Outcome>>();
  Told told = promise->get_future().share();
  write(id, event, on_failure, true, [promise, then, is_told = false](const Outcome& outcome) mutable {
    if (then) then(outcome);
    if (!std::exchange(is_told, true)) promise->set_value(outcome);
  });
  return told;
}

bool JobTable::happen(Job& job, decltype(JobEvent::what) what, Aftermath& after) {
  const JobEvent event = now(job, std::move(what));
  apply_now(job.view.id, event, after);
  if (job.is_written)
    write(job.view.id, event, Journal::OnFailure::retry, false);
  else
    announce(job.view.id, event, std::nullopt, after);
  return true;
}

bool JobTable::finish(Job& job, JobEvent::Ended how, Aftermath& after) {
  if (proto::has_ended(job.view.state) || job.ending.valid()) return false;
  check_step(job.view.state, how.state);
  how.figures = job.progress->figures();
  how.tested = job.view.tested;
  const bool stops = how.state != JobState::completed;
  const JobEvent event = now(job, std::move(how));
  try {
    if (job.is_written) {
      const std::string& id = job.view.id;
      job.ending = write_and_tell(id, event, Journal::OnFailure::retry,
                                  [this, id, event](const Outcome& outcome) { has_been_written(id, event, outcome); });
      if (stops) job.stop.request_stop();
      return true;
    }
  } catch (const std::bad_alloc&) {  // Then the next daemon does it again.
  }
  apply_now(job.view.id, event, after);
  announce(job.view.id, event, std::nullopt, after);
  forget_oldest(after);
  return true;
}

void JobTable::has_been_written(const std::string& id, const JobEvent& end, const Outcome& outcome) {
  // Who cancels a job wants the work to stop, written down or not.
  if (outcome && std::get<JobEvent::Ended>(end.what).state != JobState::canceled) return;
  Aftermath after;
  const std::lock_guard lock(mutex_);
  if (!find_unfinished(id)) return;  // A try before has said so.
  apply_now(id, end, after);
  forget_oldest(after);
}

void JobTable::forget_oldest(Aftermath& after) {
  try {
    while (ended_.size() > limits_.ended_jobs) expire(jobs_.find(ended_.front()), after);
  } catch (const std::bad_alloc&) {  // The next job that ends makes up for it.
  }
}

void JobTable::expire(Jobs::iterator ended, Aftermath& after) {
  remember_expired(ended->first);
  const JobEvent event =
      now(ended->second, JobEvent::Removed{.expired = true, .owner = ended->second.view.order->owner});
  if (ended->second.is_written)
    write(ended->first, event, Journal::OnFailure::retry, false);
  else
    announce(ended->first, event, std::nullopt, after);
  drop(ended, after);
}

void JobTable::remember_expired(const std::string& id) {
  expired_.insert(id);
  if (expired_.size() > kMostExpired) expired_.erase(expired_.begin());  // Ids grow.
}

Problem JobTable::absent(const std::string& id) const {
  if (!expired_.contains(id)) return no_such_job();
  return {
      ProblemCode::gone, "The job has expired: the server keeps only so many, and for so long. Submit it again.", {}};
}

void JobTable::look_after(const Retention& retention, JobTimes::Clock::time_point now_is) {
  const auto is_over = [&](std::chrono::seconds limit, const std::optional<JobTimes::Clock::time_point>& since) {
    return limit.count() > 0 && since && now_is - *since > limit;
  };
  Aftermath after;
  const std::lock_guard lock(mutex_);
  for (auto& [id, job] : jobs_)
    if (!proto::has_ended(job.view.state) && is_over(retention.work, job.view.times.preparing) && find_at_work(id))
      finish(job, {JobState::failed, "It took longer than a job may here (--max-job-seconds)."}, after);
  while (!ended_.empty() && is_over(retention.job_age, jobs_.find(ended_.front())->second.view.times.ended))
    expire(jobs_.find(ended_.front()), after);
  if (retention.image_bytes == 0 && retention.image_age.count() == 0) return;
  std::uint64_t on_disk = 0;
  for (const std::string& id : ended_)
    if (const Job& job = jobs_.find(id)->second; job.has_image) on_disk += job.film_bytes;
  for (const std::string& id : ended_) {
    Job& job = jobs_.find(id)->second;
    if (!job.has_image) continue;
    const bool is_too_much = retention.image_bytes > 0 && on_disk > retention.image_bytes;
    if (!is_too_much && !is_over(retention.image_age, job.view.times.ended)) break;
    on_disk -= job.film_bytes;
    const JobEvent event = now(job, JobEvent::ImageGone{});
    apply(id, event, after);
    write(id, event, Journal::OnFailure::retry, false);
  }
}

void JobTable::drop_film(Job& job, Aftermath& after) {
  try {
    if (job.film.use_count() > 1) leaving_.emplace_back(job.film, job.film_bytes);
    after.films.push_back(job.film);
  } catch (const std::bad_alloc&) {  // Then it isn't counted any more, or freed here.
  }
  job.film.reset();
  ended_bytes_ -= job.film_bytes;
  job.spare_nodes.splice(job.spare_nodes.end(), ended_images_, job.among_images);
  if (!job.has_image) job.view.image = proto::ImageState::gone;
}

void JobTable::drop(Jobs::iterator ended, Aftermath& after) {
  Job& job = ended->second;
  if (job.film) drop_film(job, after);
  forget_files(job, after);
  if (const auto& retry = job.view.order->retry) retries_.erase(retry->key);
  after.audience.add(events_.forget(job.view.id));
  --by_state_[index_of(job.view.state)];
  ended_.erase(job.among_ended);
  jobs_.erase(ended);
}

}  // namespace tessera::server
